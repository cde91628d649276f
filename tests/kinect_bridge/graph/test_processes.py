"""Bridges as real processes, as a launch file starts them."""

import itertools
import json
import os
import socket
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from pose_msgs.msg import SkeletonArray
from rclpy.qos import qos_profile_sensor_data

from pose_core.stamps import nanoseconds

pytestmark = pytest.mark.graph

CSV = Path(__file__).parents[2] / "kinect_bridge" / "data" / "two_sensors.csv"
LAUNCH_FILE = Path(__file__).parents[3] / "src" / "kinect_bridge" / "launch" / "kinect.launch.yaml"
MS = 1_000_000  # [ns]
RATE = 4.0
INTERVAL_NS = 25 * MS  # 100 ms in the file
DELAY_NS = 10 * MS  # of the right sensor behind the left: 40 ms in the file
PERIOD_NS = 160 * MS  # first frame of the left to last of the right, and an interval


def executable(name: str, package: str = "kinect_bridge") -> Path:
    for prefix in os.environ["AMENT_PREFIX_PATH"].split(os.pathsep):
        path = Path(prefix) / "lib" / package / name
        if path.exists():
            return path
    raise AssertionError(f"{package} has no executable {name}")


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
    start_ns = time.time_ns()

    for name in received:
        # In quotes: for ROS a bare number would be no string.
        start_process(
            command(
                name=name, file=CSV, sensor=name, loop="true", rate=RATE, start_at=f"'{start_ns}'"
            )
        )
    spin_until(
        lambda: min(len(messages) for messages in received.values()) >= 12, what="two rounds each"
    )

    # Whenever each began to be heard: every stamp is a moment of the recording, in some round.
    for name, begin_ns in (("left", 0), ("right", DELAY_NS)):
        stamps = np.array([nanoseconds(message.header.stamp) for message in received[name]])
        rounds, since_begin = np.divmod(stamps - start_ns - begin_ns + 1_000, PERIOD_NS)
        np.testing.assert_allclose(since_begin / INTERVAL_NS % 1, 0, atol=1e-4)
        assert since_begin.max() < 5.01 * INTERVAL_NS
        assert rounds.max() > rounds.min()


def test_a_bad_file_is_one_line_and_status_1(start_process):
    process = start_process(command(file="/no/such.csv"))

    assert process.wait() == 1
    assert process.output == ("error: found no file /no/such.csv: give the path of a recording\n")


def test_ctrl_c_ends_a_bridge_cleanly(start_process, ros_context, spin_until):
    received = ros_context.collect(SkeletonArray, "kinect_left/skeletons", qos_profile_sensor_data)
    process = start_process(command(file=CSV, loop="true"))
    spin_until(lambda: received, what="a frame")

    assert process.stop() == 0
    assert process.output == ""


def test_the_launch_file_starts_one_sensor_with_the_arguments_given(
    start_process, ros_context, spin_until
):
    received = ros_context.collect(SkeletonArray, "kinect_right/skeletons", qos_profile_sensor_data)
    start_ns = time.time_ns()
    arguments = {"file": CSV, "name": "right", "sensor": 1, "loop": "true", "start_at": start_ns}

    start_process(
        [
            *(sys.executable, executable("up", "pose_launch"), LAUNCH_FILE),
            *(f"{name}:={value}" for name, value in arguments.items()),
        ]
    )
    spin_until(lambda: received, what="a frame")

    assert received[0].header.frame_id == "kinect_right_optical_frame"
    since_start = nanoseconds(received[0].header.stamp) - start_ns
    assert since_start % (640 * MS) % (100 * MS) == pytest.approx(40 * MS, abs=1_000)


def test_the_launch_file_starts_a_live_source(start_process, ros_context, spin_until):
    received = ros_context.collect(SkeletonArray, "kinect_left/skeletons", qos_profile_sensor_data)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    arguments = {"source": "udp", "udp_port": port, "joint_map": "kinect_v2"}
    start_process(
        [
            *(sys.executable, executable("up", "pose_launch"), LAUNCH_FILE),
            *(f"{name}:={value}" for name, value in arguments.items()),
        ]
    )
    numbers = itertools.count()

    def send_and_look() -> bool:
        number = next(numbers)
        people = [{"id": 7, "joints": [[0.1 * i, 0.0, 2.0, 2] for i in range(25)]}]
        frame = {"v": 1, "seq": number, "time_ns": number * 20 * MS, "people": people}
        sender.sendto(json.dumps(frame).encode(), ("127.0.0.1", port))
        return bool(received)

    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        spin_until(send_and_look, what="a frame")

    assert received[0].skeletons[0].id == "7"
    assert received[0].header.frame_id == "kinect_left_optical_frame"
