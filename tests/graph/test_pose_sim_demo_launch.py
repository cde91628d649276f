"""The demo's graph, started from its launch file by ``up`` and stopped by Ctrl-C."""

import time

import pytest
from ament_index_python.packages import get_package_prefix

from pose_common.bags import open_bag
from pose_fusion.tools.demo_start import first_lead_s

pytestmark = [pytest.mark.graph, pytest.mark.xdist_group("live_graph")]


def executable(package, name):
    return f"{get_package_prefix(package)}/lib/{package}/{name}"


def test_the_graph_records_all_devices_and_leaves_nothing_behind(start_process, tmp_path):
    session = tmp_path / "session"
    generate = start_process(
        [
            executable("pose_sim", "generate"),
            *("--choreography", "squats", "--duration", "6", "--seed", "1"),
            *("-o", session),
        ]
    )
    assert generate.wait() == 0

    lead_s = first_lead_s()  # longer where the machine is busy
    start_at = str(time.time_ns() + round(lead_s * 1e9))
    graph = start_process(
        [
            executable("pose_common", "up"),
            "demo.launch.yaml",
            *(f"session:={session}", f"start_at:={start_at}", f"bag:={tmp_path / 'bag'}"),
        ]
    )
    graph.wait_for_output(r"\[kinect_left\].*recording finished")
    graph.wait_for_output(r"\[kinect_right\].*recording finished")
    graph.wait_for_output(r"imu_device has finished")

    assert graph.stop() == 0
    assert start_process.living() == []
    with open_bag(tmp_path / "bag") as bag:
        for side in ("left", "right"):
            assert bag.topics[f"/kinect_{side}/skeletons"].count > 50
        assert bag.topics["/imu_torso/data"].count > 100
        assert bag.topics["/imu_left_thigh/data_raw"].count > 100
