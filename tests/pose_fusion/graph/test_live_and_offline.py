"""A bag played through real processes gives what the offline tool makes of it."""

import numpy as np
import pytest
from ament_index_python.packages import get_package_prefix
from sensor_msgs.msg import JointState
from skeleton_bag import write_bag
from synthetic_body import extrinsics, kinematics, motion, skeleton_samples

from pose_core.stamps import nanoseconds
from pose_io.bags import open_bag

EXECUTABLES = f"{get_package_prefix('pose_fusion')}/lib/pose_fusion"
EACH_FRAME = ("-p", "output_rate:=0.0")
STATES = "/humans/bodies/subject/joint_states"

pytestmark = [pytest.mark.graph, pytest.mark.xdist_group("live_graph")]


@pytest.fixture
def bag(tmp_path):
    _, dof = motion(4.5)
    positions = kinematics().pose(dof).positions
    samples = skeleton_samples(positions, extrinsics(), np.random.default_rng(60), 0.005)
    # Best effort: what comes in the moment of discovery may be lost, and here it says nothing.
    write_bag(tmp_path / "in", samples, nobody_s=1.5)
    return tmp_path / "in"


@pytest.fixture
def offline(start_process, bag, tmp_path):
    """Positions of the joints by stamp [ns]."""
    process = start_process(
        [f"{EXECUTABLES}/fuse", bag, tmp_path / "offline", "--output-rate", "0"]
    )
    assert process.wait() == 0
    with open_bag(tmp_path / "offline") as fused:
        return by_stamp(fused.deserialize(message) for message in fused.messages([STATES]))


def last_of(offline):
    """Only the very last frames are special: offline, nobody waits for what never comes."""
    return sorted(offline)[-3]


def by_stamp(states):
    return {nanoseconds(state.header.stamp): np.array(state.position) for state in states}


@pytest.fixture
def play(start_process, ros_context, bag):
    """Play the bag to a fusion until there is a joint state of some stamp [ns], or of later."""

    def play(last_ns, of_player, of_fusion=()):
        node = ros_context.make_node("listener")
        live = ros_context.collect(JointState, STATES, 1000, node)
        start_process([f"{EXECUTABLES}/fusion", "--ros-args", *EACH_FRAME, *of_fusion])
        ros_context.spin_until(lambda: node.count_publishers(STATES), what="the fusion node")
        words = [*of_player, "--wait-for-subscribers", "60"]
        player = start_process([f"{EXECUTABLES}/player", bag, *words])
        ros_context.spin_until(
            lambda: live and nanoseconds(live[-1].header.stamp) >= last_ns, what="the last state"
        )
        assert player.wait() == 0
        return by_stamp(live)

    return play


def test_a_played_bag_is_fused_live_as_offline(play, offline):
    # Slower than it was: a busy machine loses frames that come while the node is held up.
    live = play(last_of(offline), ["--rate", "0.4"])

    assert len(live) >= len(offline) - 2
    for (stamp_ns, angles), (expected_ns, expected) in zip(
        live.items(), offline.items(), strict=False
    ):
        assert stamp_ns == expected_ns
        np.testing.assert_array_equal(angles, expected)


def test_by_the_bags_clock_a_graph_gives_the_same_joint_states(play, offline):
    live = play(last_of(offline), ["--clock", "--rate", "1"], ["-p", "use_sim_time:=true"])

    # At the pace of the recording: a busy machine may hold up a frame of a sensor here and there.
    common = sorted(set(live) & set(offline))
    assert len(common) > 0.9 * len(offline)
    assert set(live) <= set(offline)
    errors = [np.abs(live[stamp_ns] - offline[stamp_ns]).max() for stamp_ns in common]
    assert np.median(errors) < np.deg2rad(0.2)
    assert np.quantile(errors, 0.95) < np.deg2rad(2.0)
