"""The node that only listens."""

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import Point
from pose_msgs.msg import PoseEstimate, Skeleton, SkeletonArray
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import Imu
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage

from pose_core.joints import JOINT_INDEX, JOINTS
from pose_fusion.conversions import to_static_tf
from pose_fusion.nodes.listener import GraphListener
from pose_node.conversions import ns_to_stamp
from pose_node.node_status import Level
from pose_node.nodes.qos import latched


def skeletons(stamp_ns, hand_state=2):
    states = [2] * len(JOINTS)
    states[JOINT_INDEX["left_hand"]] = hand_state
    points = [Point(x=1.0, y=float(index), z=2.0) for index in range(len(JOINTS))]
    skeleton = Skeleton(id="1", name=list(JOINTS), position=points, tracking_state=states)
    message = SkeletonArray(skeletons=[skeleton])
    message.header.stamp = skeleton.header.stamp = ns_to_stamp(stamp_ns)
    return message


def found(listener, name):
    return next((topic for topic in listener.snapshot().topics if topic.name == name), None)


def test_the_listener_reports_sensors_tracking_and_latency(ros_context, spin_until):
    listener = ros_context.add(GraphListener("listener"))
    talker = ros_context.make_node("kinect_left")
    publisher = talker.create_publisher(
        SkeletonArray, "kinect_left/skeletons", qos_profile_sensor_data
    )
    spin_until(lambda: found(listener, "/kinect_left/skeletons"), what="discovery")
    spin_until(lambda: publisher.get_subscription_count() > 0, what="the subscription")

    def several():
        now_ns = talker.get_clock().now().nanoseconds
        publisher.publish(skeletons(now_ns - 50_000_000, hand_state=1))
        return found(listener, "/kinect_left/skeletons").rate > 0.0

    spin_until(several, what="messages")

    snapshot = listener.snapshot()
    assert 0.04 < found(listener, "/kinect_left/skeletons").latency_s < 5.0
    share = snapshot.tracked["/kinect_left/skeletons"]
    assert share[JOINT_INDEX["left_hand"]] == 0.0
    assert share[JOINT_INDEX["head"]] == 1.0
    assert "/kinect_left" in snapshot.nodes


def test_the_listener_counts_the_publishers_of_a_topic(ros_context, spin_until):
    listener = ros_context.add(GraphListener("listener"))
    for name in ("kinect_left", "relay"):
        ros_context.make_node(name).create_publisher(SkeletonArray, "kinect_left/skeletons", 10)
    spin_until(
        lambda: (topic := found(listener, "/kinect_left/skeletons")) and topic.publishers == 2,
        what="both publishers",
    )


def test_the_listener_receives_its_own_messages_and_lists_no_node_of_its_own(
    ros_context, spin_until
):
    listener = ros_context.add(GraphListener("listener"))
    spin_until(lambda: listener.snapshot().hears_itself, what="its own message")
    assert listener.snapshot().nodes == ()


@pytest.mark.parametrize("namespace", ["", "/operator_1"])
def test_the_listener_reports_diagnostics_extrinsics_and_latency(
    ros_context, spin_until, namespace
):
    listener = ros_context.add(GraphListener("listener"))
    talker = ros_context.make_node("talker", namespace=namespace)
    diagnostics = talker.create_publisher(DiagnosticArray, "/diagnostics", 10)
    estimates = talker.create_publisher(PoseEstimate, "humans/bodies/me/estimate", 10)
    places = talker.create_publisher(TFMessage, "tf_static", latched(1))
    places.publish(to_static_tf({"left": np.eye(4)}))
    status = DiagnosticStatus(level=b"\x01", name="/fusion", message="waiting for extrinsics")

    def complete():
        diagnostics.publish(DiagnosticArray(status=[status]))
        estimates.publish(PoseEstimate(id="me", latency=0.02))
        snapshot = listener.snapshot()
        return snapshot.statuses and snapshot.fusion_latency_s and snapshot.placed_sensors

    spin_until(complete, what="all three")

    snapshot = listener.snapshot()
    assert (snapshot.statuses[0].name, snapshot.statuses[0].level) == ("/fusion", Level.WARN)
    assert snapshot.statuses[0].message == "waiting for extrinsics"
    assert snapshot.fusion_latency_s[0] == 0.02
    assert snapshot.placed_sensors == ("left",)


def test_malformed_skeletons_are_counted_and_foreign_topics_ignored(ros_context, spin_until):
    listener = ros_context.add(GraphListener("listener"))
    talker = ros_context.make_node("talker")
    publisher = talker.create_publisher(SkeletonArray, "kinect_left/skeletons", 10)
    talker.create_publisher(String, "chatter", 10)
    talker.create_publisher(Imu, "imu_pelvis/data", 10)
    message = skeletons(0)
    message.skeletons[0].name = ["head"]

    def counted():
        publisher.publish(message)
        return listener.counters["malformed_messages"] > 0

    spin_until(counted, what="the count")
    spin_until(lambda: found(listener, "/imu_pelvis/data"), what="the IMU")
    names = {topic.name for topic in listener.snapshot().topics}
    assert names == {"/kinect_left/skeletons", "/imu_pelvis/data"}
