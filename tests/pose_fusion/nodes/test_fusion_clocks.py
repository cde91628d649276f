"""The fusion node takes the calibration's clocks from their topic."""

import pytest
from diagnostic_msgs.msg import DiagnosticArray
from pose_msgs.msg import SkeletonArray
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import Imu, JointState, TimeReference
from synthetic_body import extrinsics
from tf2_msgs.msg import TFMessage

from pose_core.streams.clocks import IMUS, Clock
from pose_fusion.conversions import to_clock_messages, to_static_tf
from pose_fusion.nodes.fusion import FusionNode
from pose_node.node_status import Level

LATCHED = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def test_clock_offsets_of_the_topic_are_used_reported_and_kept_with_new_extrinsics(ros_context):
    fusion = ros_context.add(FusionNode())
    reports = ros_context.collect(DiagnosticArray, "/diagnostics", 10)
    calibration = ros_context.make_node("calibrated")
    clocks = {"right": Clock(offset_ns=80_000_000), IMUS: Clock(offset_ns=-250_000_000)}
    publisher = calibration.create_publisher(TimeReference, "clock_offsets", LATCHED)
    for message in to_clock_messages(clocks, 1_700_000_000 * 10**9):
        publisher.publish(message)
    ros_context.spin_until(lambda: len(fusion.pipeline.clocks) == 2, what="the clocks")
    placed = {sensor: extrinsics().T_map_sensor(sensor) for sensor in ("left", "right")}
    calibration.create_publisher(TFMessage, "/tf_static", LATCHED).publish(to_static_tf(placed))
    ros_context.spin_until(lambda: fusion.pipeline.extrinsics is not None, what="extrinsics")
    assert {s: c.offset_ns for s, c in fusion.pipeline.clocks.items()} == {
        "right": 80_000_000,
        IMUS: -250_000_000,
    }

    def shown():
        own = [s for report in reports for s in report.status if s.name == "/fusion"]
        values = {v.key: v.value for v in own[-1].values} if own else {}
        return values.get("clock_ahead_ms/right"), values.get("clock_ahead_ms/imus")

    ros_context.spin_until(lambda: shown() == ("80.0", "-250.0"), what="the diagnostics")


def test_a_clock_of_another_epoch_is_refused_and_reported(ros_context):
    fusion = ros_context.add(FusionNode())
    other = ros_context.make_node("other")
    publisher = other.create_publisher(TimeReference, "clock_offsets", LATCHED)
    years = {"right": Clock(offset_ns=1_700_000_000 * 10**9)}
    publisher.publish(to_clock_messages(years, 60 * 10**9)[0])
    ros_context.spin_until(
        lambda: "different epochs" in fusion.report().message, what="the warning"
    )
    assert not fusion.pipeline.clocks


@pytest.mark.parametrize(
    ("kind", "topic"),
    [
        (SkeletonArray, "kinect_left/skeletons"),
        (Imu, "imu_torso/data"),
        (JointState, "humans/bodies/subject/joint_states"),
    ],
)
def test_topics_with_several_publishers_are_named_with_their_number(ros_context, kind, topic):
    fusion = ros_context.add(FusionNode())
    other = ros_context.make_node("other")
    own = topic.startswith("humans")
    for _ in range(2 - own):
        other.create_publisher(kind, topic, 10)
    remark = f"2 publishers of {topic}: started twice? Stop all but one"
    ros_context.spin_until(lambda: remark in fusion.report().message, what="the remark")
    assert fusion.report().level == Level.WARN
