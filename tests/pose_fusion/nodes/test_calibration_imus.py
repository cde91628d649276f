"""The calibration node hears body-worn IMUs, and tells how their clock stands."""

from diagnostic_msgs.msg import DiagnosticArray
from pose_msgs.msg import SkeletonArray
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
from sample_messages import skeleton_message
from sensor_msgs.msg import Imu, TimeReference
from walking_person import samples

from pose_core.stamps import nanoseconds
from pose_core.streams.clocks import IMUS, Clock
from pose_fusion.nodes.calibration import CalibrationNode
from pose_node.conversions import ns_to_stamp

LATCHED = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def imu_message(stamp_ns):
    message = Imu()
    message.header.stamp = ns_to_stamp(stamp_ns)
    message.orientation.w = 1.0
    return message


def test_imu_samples_are_collected_with_the_frames(ros_context):
    node = ros_context.add(CalibrationNode())
    reports = ros_context.collect(DiagnosticArray, "/diagnostics", 10)
    tester = ros_context.make_node("sensors")
    imu = tester.create_publisher(Imu, "imu_left_thigh/data", qos_profile_sensor_data)
    skeletons = tester.create_publisher(
        SkeletonArray, "kinect_left/skeletons", qos_profile_sensor_data
    )
    for publisher in (imu, skeletons):
        ros_context.spin_until(publisher.get_subscription_count, what="the node")
    some = iter(one for one in samples(duration_s=60.0) if one.sensor == "left")

    def heard():
        one = next(some)
        imu.publish(imu_message(one.stamp_ns))
        skeletons.publish(skeleton_message(one))
        return node.calibration.imu_memory.segments == ("left_thigh",)

    ros_context.spin_until(heard, what="the IMU")

    def shown():
        own = [s for report in reports for s in report.status if s.name == "/calibration"]
        return bool(own) and {v.key: v.value for v in own[-1].values}["imus"] == "left_thigh"

    ros_context.spin_until(shown, what="the diagnostics")


def test_a_clock_offset_that_vanishes_is_published(ros_context):
    node = ros_context.add(CalibrationNode())
    told = ros_context.collect(TimeReference, "clock_offsets", LATCHED)
    node._publish_clocks({IMUS: Clock(offset_ns=90_000_000)})
    node._publish_clocks({})
    ros_context.spin_until(lambda: len(told) == 2, what="two messages")
    ahead_ns = [nanoseconds(one.time_ref) - nanoseconds(one.header.stamp) for one in told]
    assert [one.source for one in told] == [IMUS, IMUS]
    assert ahead_ns == [90_000_000, 0]
