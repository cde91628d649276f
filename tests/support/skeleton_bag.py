"""Bags of two Kinects' skeletons."""

from pose_msgs.msg import SkeletonArray
from sample_messages import skeleton_message
from synthetic_body import extrinsics

from pose_fusion.conversions import to_bag_message, to_static_tf
from pose_io.bag_writer import BagWriter
from pose_node.conversions import to_header


def write_bag(path, samples, with_extrinsics=True, nobody_s=0.0):
    """A bag of skeletons, after a while in which the sensors see nobody."""
    with BagWriter(path) as writer:
        if with_extrinsics:
            writer.add_topic("/tf_static", "tf2_msgs/msg/TFMessage", latched=True)
            placed = {s: extrinsics().T_map_sensor(s) for s in ("left", "right")}
            message = to_static_tf(placed)
            message = to_bag_message(message, writer.typestore)
            writer.write("/tf_static", message, samples[0].stamp_ns)
        for k in range(round(30 * nobody_s), 0, -1):
            for sensor in ("left", "right"):
                stamp_ns = samples[0].stamp_ns - k * 33_333_333
                header = to_header(stamp_ns, f"kinect_{sensor}_optical_frame")
                empty = to_bag_message(SkeletonArray(header=header), writer.typestore)
                writer.write(f"/kinect_{sensor}/skeletons", empty, stamp_ns)
        for sample in samples:
            message = skeleton_message(sample)
            writer.write(
                f"/kinect_{sample.sensor}/skeletons",
                to_bag_message(message, writer.typestore),
                sample.stamp_ns + 3_000_000,
            )
