"""The demo's graph, started from its launch file by ``up`` and stopped by Ctrl-C."""

import time

import pytest
from ament_index_python.packages import get_package_prefix

from pose_common.bags import open_bag

pytestmark = pytest.mark.graph

STARTING_S = 8  # for the processes to be there before the first frame


def executable(package, name):
    return f"{get_package_prefix(package)}/lib/{package}/{name}"


def test_the_graph_records_all_devices_and_leaves_nothing_behind(start_process, tmp_path):
    session = tmp_path / "session"
    start_at = str(time.time_ns() + STARTING_S * 10**9)
    generate = start_process(
        [
            executable("pose_sim", "generate"),
            *("--choreography", "squats", "--duration", "6", "--seed", "1"),
            *("--start-at", start_at, "-o", session),
        ]
    )
    assert generate.wait(60.0) == 0

    graph = start_process(
        [
            executable("pose_common", "up"),
            "demo.launch.yaml",
            *(f"session:={session}", f"start_at:={start_at}", f"bag:={tmp_path / 'bag'}"),
        ]
    )
    graph.wait_for_output(r"\[kinect_left\].*recording finished", 60.0)
    graph.wait_for_output(r"\[kinect_right\].*recording finished", 60.0)
    graph.wait_for_output(r"imu_device has finished", 60.0)

    assert graph.stop(30.0) == 0
    assert start_process.living() == []
    with open_bag(tmp_path / "bag") as bag:
        for side in ("left", "right"):
            assert bag.topics[f"/kinect_{side}/skeletons"].count > 50
        assert bag.topics["/imu_torso/data"].count > 100
        assert bag.topics["/imu_left_thigh/data_raw"].count > 100
