"""The demo's graph, started from its launch file by ``up`` and stopped by Ctrl-C."""

import time

import pytest

from pose_fusion.tools.demo_run import first_lead_s
from pose_io.bags import open_bag
from pose_node.child_process import executable

pytestmark = [pytest.mark.graph, pytest.mark.xdist_group("live_graph")]

LEAST = {  # messages, of a session of six seconds
    "/kinect_left/skeletons": 50,
    "/kinect_right/skeletons": 50,
    "/imu_torso/data": 100,
    "/imu_left_thigh/data_raw": 100,
}
ROUNDS = 3  # each with twice the time for the nodes to start: a machine may become busy meanwhile


def recorded(start_process, session, bag, lead_s):
    """Run the graph once, in which the session begins after so long; what it has recorded."""
    start_at = time.time_ns() + round(lead_s * 1e9)
    graph = start_process(
        [
            executable("pose_launch", "up"),
            "demo.launch.yaml",
            *(f"session:={session}", f"start_at:={start_at}", f"bag:={bag}"),
        ]
    )
    graph.wait_for_output(r"\[kinect_left\].*recording finished")
    graph.wait_for_output(r"\[kinect_right\].*recording finished")
    graph.wait_for_output(r"imu_device has finished")

    assert graph.stop() == 0
    assert start_process.living() == []
    with open_bag(bag) as opened:
        return {name: opened.topics[name].count if name in opened.topics else 0 for name in LEAST}


def test_the_graph_records_all_devices_and_leaves_nothing_behind(start_process, tmp_path):
    session = tmp_path / "session"
    generate = start_process(
        [
            executable("pose_sim", "generate"),
            *("--choreography", "squats", "--duration", "6", "--seed", "1", "-o", session),
        ]
    )
    assert generate.wait() == 0

    lead_s = first_lead_s()
    for k in range(ROUNDS):
        counts = recorded(start_process, session, tmp_path / f"bag{k}", lead_s * 2**k)
        if all(counts[name] > least for name, least in LEAST.items()):
            return
    pytest.fail(f"the devices' messages did not come through: {counts}")
