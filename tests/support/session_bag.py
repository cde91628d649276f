"""Samples as bags of the live graph and of pose_sim."""

import numpy as np
from scipy.spatial.transform import Rotation

from pose_core.joints import JOINTS
from pose_core.streams.samples import ImuSample
from pose_io.bag_writer import BagWriter
from pose_io.typestore import make_typestore

TYPES = make_typestore().types
POINT = TYPES["geometry_msgs/msg/Point"]
VECTOR = TYPES["geometry_msgs/msg/Vector3"]
QUATERNION = TYPES["geometry_msgs/msg/Quaternion"]
TRUTH = "/truth/humans/bodies/subject/skeleton"
SYNTHETIC = "synthetic: no person, made for a test"


def header(stamp_ns, frame):
    seconds, nanoseconds = divmod(int(stamp_ns), 10**9)
    stamp = TYPES["builtin_interfaces/msg/Time"](sec=seconds, nanosec=nanoseconds)
    return TYPES["std_msgs/msg/Header"](stamp=stamp, frame_id=frame)


def skeleton(stamp_ns, positions, state, frame="map", person="1"):
    return TYPES["pose_msgs/msg/Skeleton"](
        header=header(stamp_ns, frame),
        id=person,
        name=list(JOINTS),
        position=[POINT(*map(float, position)) for position in np.nan_to_num(positions)],
        tracking_state=np.asarray(state, np.uint8),
    )


def static_transforms(T_map_sensor):
    transforms = []
    for sensor, T in T_map_sensor.items():
        transform = TYPES["geometry_msgs/msg/Transform"](
            translation=VECTOR(*map(float, T[:3, 3])),
            rotation=QUATERNION(*map(float, Rotation.from_matrix(T[:3, :3]).as_quat())),
        )
        transforms.append(
            TYPES["geometry_msgs/msg/TransformStamped"](
                header=header(0, "map"),
                child_frame_id=f"kinect_{sensor}_optical_frame",
                transform=transform,
            )
        )
    return TYPES["tf2_msgs/msg/TFMessage"](transforms=transforms)


def imu(sample):
    variance = np.zeros(9)
    variance[[0, 4, 8]] = sample.orientation_stddev**2
    return TYPES["sensor_msgs/msg/Imu"](
        header=header(sample.stamp_ns, f"imu_{sample.segment}_link"),
        orientation=QUATERNION(*map(float, sample.orientation)),
        orientation_covariance=variance,
        angular_velocity=VECTOR(*map(float, sample.angular_velocity)),
        angular_velocity_covariance=np.zeros(9),
        linear_acceleration=VECTOR(*map(float, np.nan_to_num(sample.linear_acceleration))),
        linear_acceleration_covariance=np.zeros(9),
    )


def comment(stamp_ns, text):
    """What kinect_bridge repeats of its recording in its diagnostics."""
    pair = TYPES["diagnostic_msgs/msg/KeyValue"](key="comment", value=text)
    status = TYPES["diagnostic_msgs/msg/DiagnosticStatus"](
        level=0, name="/kinect_left", message="", hardware_id="", values=[pair]
    )
    return TYPES["diagnostic_msgs/msg/DiagnosticArray"](
        header=header(stamp_ns, ""), status=[status]
    )


def write_session(path, samples, T_map_sensor=None, text=SYNTHETIC):
    """What went into the fusion, in the order of its stamps."""
    samples = sorted(samples, key=lambda sample: sample.stamp_ns)
    with BagWriter(path) as bag:
        if T_map_sensor:
            bag.write("/tf_static", static_transforms(T_map_sensor), samples[0].stamp_ns)
        if text:
            bag.write("/diagnostics", comment(samples[0].stamp_ns, text), samples[0].stamp_ns)
        for sample in samples:
            if isinstance(sample, ImuSample):
                bag.write(f"/imu_{sample.segment}/data", imu(sample), sample.stamp_ns)
                continue
            frame = f"kinect_{sample.sensor}_optical_frame"
            seen = skeleton(
                sample.stamp_ns, sample.positions, sample.tracking_state, frame, sample.person
            )
            message = TYPES["pose_msgs/msg/SkeletonArray"](header=seen.header, skeletons=[seen])
            bag.write(f"/kinect_{sample.sensor}/skeletons", message, sample.stamp_ns)
    return path


def write_truth(path, series):
    """A synthetic subject's truth."""
    with BagWriter(path) as bag:
        about = TYPES["std_msgs/msg/String"](data=SYNTHETIC)
        bag.write("/truth/about", about, int(series.stamps_ns[0]))
        for stamp_ns, positions, state in zip(
            series.stamps_ns, series.positions, series.tracking_state, strict=True
        ):
            bag.write(TRUTH, skeleton(stamp_ns, positions, state), int(stamp_ns))
    return path
