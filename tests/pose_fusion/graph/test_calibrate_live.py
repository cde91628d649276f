"""``./pose calibrate live``: from running sensors to a file (a synthetic walking person)."""

import itertools
import sys
from dataclasses import replace

import numpy as np
import pytest
from pose_msgs.msg import SkeletonArray
from rclpy.qos import qos_profile_sensor_data
from sample_messages import skeleton_message
from walking_person import LEFT, RIGHT, angle_deg, samples

from pose_calibration.files.extrinsics_file import load_extrinsics
from pose_core.transforms import inverse

pytestmark = [pytest.mark.graph, pytest.mark.xdist_group("live_graph")]

TOOL = [sys.executable, "-c", "from pose_fusion.tools.calibrate import main; main()", "live"]


def publishers(context):
    node = context.make_node("sensors")
    return {
        name: node.create_publisher(
            SkeletonArray, f"kinect_{name}/skeletons", qos_profile_sensor_data
        )
        for name in ("left", "right")
    }


def seen_again_and_again():
    """A minute of the person's walk over and over: who knows how much of it is missed."""
    minute = samples(duration_s=60.0)
    for k in itertools.count():
        for one in minute:
            yield replace(one, stamp_ns=one.stamp_ns + k * 60_000_000_000)


def test_a_walking_person_gives_an_extrinsics_file_and_the_tool_ends(
    ros_context, start_process, tmp_path
):
    output = tmp_path / "extrinsics.yaml"
    sensors = publishers(ros_context)
    enough = ["--enough-rotation-stddev", "0.03", "--enough-position-stddev", "0.1"]
    tool = start_process([*TOOL, "-o", output, *enough])
    for publisher in sensors.values():
        ros_context.spin_until(publisher.get_subscription_count, what="the tool")
    some = seen_again_and_again()

    def publish_until_it_ends():
        for _ in range(4):  # about four times as fast as real sensors
            one = next(some)
            sensors[one.sensor].publish(skeleton_message(one))
        return tool.returncode is not None

    ros_context.spin_until(publish_until_it_ends, what="the tool's end")
    assert tool.returncode == 0
    true = inverse(LEFT) @ RIGHT
    found = load_extrinsics(output).T_reference_sensor["right"]
    assert angle_deg(found, true) < 1.5
    assert np.linalg.norm(found[:3, 3] - true[:3, 3]) < 0.06
    assert "'right' known to" in tool.output


def test_without_a_person_the_tool_ends_with_the_reason(start_process, tmp_path):
    tool = start_process([*TOOL, "-o", tmp_path / "extrinsics.yaml", "--timeout", "1.0"])
    assert tool.wait() == 1
    assert "error: not calibrated within 1 s: no skeletons from left, right yet" in tool.output
    assert list(tmp_path.glob("*.yaml")) == []


def test_ros_arguments_put_the_tool_into_the_sensors_namespace(
    ros_context, start_process, tmp_path
):
    node = ros_context.make_node("sensors")
    publisher = node.create_publisher(
        SkeletonArray, "/lab/kinect_left/skeletons", qos_profile_sensor_data
    )
    start_process([*TOOL, "-o", tmp_path / "e.yaml", "--ros-args", "-r", "__ns:=/lab"])
    ros_context.spin_until(publisher.get_subscription_count, what="the tool")
