"""The fusion node goes on after messages that no sensor should send, and says so."""

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import TransformStamped
from pose_msgs.msg import Skeleton, SkeletonArray
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
from sample_messages import points
from sensor_msgs.msg import Imu
from tf2_msgs.msg import TFMessage

from pose_core.joints import JOINTS
from pose_fusion.nodes.fusion import FusionNode

LATCHED = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def test_bad_transforms_and_missing_joints_are_counted(ros_context):
    ros_context.add(FusionNode())
    reports = ros_context.collect(DiagnosticArray, "/diagnostics", 10)
    node = ros_context.make_node("bad")
    transforms = node.create_publisher(TFMessage, "/tf_static", LATCHED)
    skeletons = node.create_publisher(
        SkeletonArray, "kinect_left/skeletons", qos_profile_sensor_data
    )
    ros_context.spin_until(skeletons.get_subscription_count, what="discovery")
    placed = TransformStamped(child_frame_id="kinect_left_optical_frame")
    placed.header.frame_id = "map"
    placed.transform.rotation.w = 0.0
    transforms.publish(TFMessage(transforms=[placed]))
    skeleton = Skeleton(
        name=list(JOINTS),
        position=points([(1e30, 0.0, 2.0)] * 4 + [(0.1, 0.2, 2.0)] * 11),
        tracking_state=[2] * 15,
    )
    skeletons.publish(SkeletonArray(skeletons=[skeleton]))

    def reported():
        own = [s for r in reports for s in r.status if s.name == "/fusion"]
        values = {v.key: v.value for v in own[-1].values} if own else {}
        return (values.get("malformed_transforms"), values.get("joints_not_tracked")) == ("1", "4")

    ros_context.spin_until(reported, what="the counts")


def test_messages_that_a_full_queue_dropped_are_counted_and_said(ros_context):
    ros_context.add(FusionNode())
    reports = ros_context.collect(DiagnosticArray, "/diagnostics", 10)
    imus = ros_context.make_node("imus").create_publisher(
        Imu, "imu_torso/data", qos_profile_sensor_data
    )
    ros_context.spin_until(imus.get_subscription_count, what="discovery")
    for _ in range(3):
        imus.publish(Imu())
    ros_context.spin_until(lambda: reports, what="a report")
    for _ in range(500):  # while nobody takes them
        imus.publish(Imu())

    def said():
        own = [s for r in reports for s in r.status if s.name == "/fusion"]
        return [s for s in own if "messages of imu/torso were lost" in s.message]

    ros_context.spin_until(said, what="the warning")
    (first, *_) = said()
    lost = int({v.key: v.value for v in first.values}["messages_lost"])
    assert first.level == DiagnosticStatus.WARN
    assert 0 < lost < 500
