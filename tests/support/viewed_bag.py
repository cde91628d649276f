"""A short recording for the viewer: three bodies with moving limbs, two sensors (synthetic)."""

import numpy as np
from geometry_msgs.msg import Point
from pose_msgs.msg import Skeleton, SkeletonArray
from synthetic_body import extrinsics, kinematics, motion, skeleton_samples

from pose_core.joints import JOINTS, TrackingState
from pose_fusion.conversions import to_bag_message, to_static_tf
from pose_io.bag_writer import BagWriter
from pose_node.conversions import to_header

BODIES = ("subject_kinect", "subject", "subject_imu")
START_NS = 10**18
FRAME_NS = 33_333_333


def moving_joints(duration_s, still_s=0.0):
    """Joints in map at 30 Hz, shape (n, 15, 3) [m]."""
    _, dof = motion(duration_s, still_s=still_s)
    return kinematics().pose(dof).positions


def skeleton_message(positions, header, person, state=TrackingState.TRACKED):
    """A ``pose_msgs/Skeleton`` of joints (15, 3)."""
    return Skeleton(
        header=header,
        id=person,
        name=list(JOINTS),
        position=[Point(x=x, y=y, z=z) for x, y, z in np.asarray(positions).tolist()],
        tracking_state=[int(state)] * len(JOINTS),
    )


def write_viewed_bag(path, duration_s=6.0, bodies=BODIES):
    """Write it; the joints that the bodies have, shape (n, 15, 3)."""
    positions = moving_joints(duration_s)
    with BagWriter(path) as writer:

        def write(topic, message, stamp_ns):
            writer.write(topic, to_bag_message(message, writer.typestore), stamp_ns)

        writer.add_topic("/tf_static", "tf2_msgs/msg/TFMessage", latched=True)
        placed = {s: extrinsics().T_map_sensor(s) for s in ("left", "right")}
        write("/tf_static", to_static_tf(placed), START_NS)
        for sample in skeleton_samples(positions, extrinsics(), start_ns=START_NS):
            header = to_header(sample.stamp_ns, f"kinect_{sample.sensor}_optical_frame")
            seen = skeleton_message(sample.positions, header, sample.person)
            message = SkeletonArray(header=header, skeletons=[seen])
            write(f"/kinect_{sample.sensor}/skeletons", message, sample.stamp_ns)
        for k, joints in enumerate(positions):
            stamp_ns = START_NS + k * FRAME_NS
            for body in bodies:
                message = skeleton_message(joints, to_header(stamp_ns, "map"), body)
                write(f"/humans/bodies/{body}/skeleton", message, stamp_ns)
    return positions
