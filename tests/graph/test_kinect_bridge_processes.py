"""Bridges as real processes, as a launch file starts them."""

import os
import sys
import time
from pathlib import Path

import pytest
from pose_msgs.msg import SkeletonArray
from rclpy.qos import qos_profile_sensor_data

from pose_common.conversions import stamp_to_ns

pytestmark = pytest.mark.graph

CSV = Path(__file__).parents[1] / "data" / "kinect_bridge" / "two_sensors.csv"
MS = 1_000_000  # [ns]
LEAD_NS = 8_000 * MS  # time for two processes to start


def executable(name: str) -> Path:
    for prefix in os.environ["AMENT_PREFIX_PATH"].split(os.pathsep):
        path = Path(prefix) / "lib" / "kinect_bridge" / name
        if path.exists():
            return path
    raise AssertionError(f"kinect_bridge has no executable {name}")


def command(**parameters) -> list:
    arguments = [f"{name}:={value}" for name, value in parameters.items()]
    return [
        *(sys.executable, executable("kinect_bridge"), "--ros-args"),
        *(word for argument in arguments for word in ("-p", argument)),
    ]


def test_two_bridges_with_one_start_keep_the_sensors_timing(start_process, ros_context, spin_until):
    received = {
        name: ros_context.collect(
            SkeletonArray, f"kinect_{name}/skeletons", qos_profile_sensor_data
        )
        for name in ("left", "right")
    }
    start_ns = time.time_ns() + LEAD_NS

    for name in received:
        # Quoted twice: for ROS a bare number would be no string.
        start_process(
            command(name=name, file=CSV, sensor=name, loop="true", start_at=f"'{start_ns}'")
        )
    spin_until(
        lambda: min(len(messages) for messages in received.values()) >= 9, 40, "nine frames each"
    )

    left, right = (
        {stamp_to_ns(message.header.stamp) for message in received[name]} for name in received
    )
    offset_left, offset_right = ((min(stamps) - start_ns) for stamps in (left, right))
    assert offset_left == pytest.approx(0, abs=1000)
    assert offset_right == pytest.approx(40 * MS, abs=1000)
    # Whatever round they are in: what the recording says, to the nanosecond.
    differences = {stamp - offset_right + offset_left for stamp in right}
    common = sorted(left)[: min(len(left), len(right))]
    assert sorted(differences)[: len(common)] == common


def test_a_bad_file_is_one_line_and_status_1(start_process):
    process = start_process(command(file="/no/such.csv"))

    assert process.wait() == 1
    assert process.output == ("error: found no file /no/such.csv: give the path of a recording\n")


def test_ctrl_c_ends_a_bridge_cleanly(start_process, ros_context, spin_until):
    received = ros_context.collect(SkeletonArray, "kinect_left/skeletons", qos_profile_sensor_data)
    process = start_process(command(file=CSV, loop="true"))
    spin_until(lambda: received, 30, "a frame")

    assert process.stop() == 0
    assert process.output == ""
