"""A bag played through real processes gives what the offline tool makes of it."""

import numpy as np
import pytest
from ament_index_python.packages import get_package_prefix
from sensor_msgs.msg import JointState
from skeleton_bag import write_bag
from synthetic_body import extrinsics, kinematics, motion, skeleton_samples

from pose_core.api import estimate_body_shape, load_body_model, save_body_shape
from pose_core.stamps import nanoseconds
from pose_io.bags import open_bag

EXECUTABLES = f"{get_package_prefix('pose_fusion')}/lib/pose_fusion"
EACH_FRAME = ("-p", "output_rate:=0.0")
STATES = "/humans/bodies/subject/joint_states"

pytestmark = [pytest.mark.graph, pytest.mark.xdist_group("live_graph")]


@pytest.fixture
def bag(tmp_path):
    _, dof = motion(4.0)
    positions = kinematics().pose(dof).positions
    samples = skeleton_samples(positions, extrinsics(), np.random.default_rng(60), 0.005)
    # Best effort: what comes in the moment of discovery may be lost, and here it says nothing.
    write_bag(tmp_path / "in", samples, nobody_s=1.0)
    return tmp_path / "in"


@pytest.fixture
def measures(tmp_path):
    """A file of the person's body measures: the tool would measure them over the whole bag."""
    model, (_, dof) = load_body_model("default"), motion(1.0)
    shape = estimate_body_shape(model, kinematics().pose(dof).positions)
    save_body_shape(tmp_path / "body.yaml", model, shape, "subject")
    return tmp_path / "body.yaml"


@pytest.fixture
def offline(start_process, bag, measures, tmp_path):
    """Positions of the joints by stamp [ns]."""
    words = ["--output-rate", "0", "--shape-file", measures]
    process = start_process([f"{EXECUTABLES}/fuse", bag, tmp_path / "offline", *words])
    assert process.wait() == 0
    with open_bag(tmp_path / "offline") as fused:
        return by_stamp(fused.deserialize(message) for message in fused.messages([STATES]))


def last_of(offline):
    """Only the very last frames are special: offline, nobody waits for what never comes."""
    return sorted(offline)[-3]


def by_stamp(states):
    return {nanoseconds(state.header.stamp): np.array(state.position) for state in states}


def test_live_and_offline_fusion_of_a_bag_agree(start_process, ros_context, bag, measures, offline):
    node = ros_context.make_node("listener")
    received = ros_context.collect(JointState, STATES, 1000, node)
    start_process(
        [f"{EXECUTABLES}/fusion", "--ros-args", *EACH_FRAME, "-p", f"shape_file:={measures}"]
    )
    ros_context.spin_until(lambda: node.count_publishers(STATES), what="the fusion node")
    # Slower than it was: a busy machine loses frames that come while the node is held up.
    words = ["--rate", "0.4", "--wait-for-subscribers", "60"]
    player = start_process([f"{EXECUTABLES}/player", bag, *words])
    ros_context.spin_until(
        lambda: received and nanoseconds(received[-1].header.stamp) >= last_of(offline),
        what="the last state",
    )
    assert player.wait() == 0

    live = by_stamp(received)
    assert len(live) >= len(offline) - 2
    for (stamp_ns, angles), (expected_ns, expected) in zip(
        live.items(), offline.items(), strict=False
    ):
        assert stamp_ns == expected_ns
        np.testing.assert_array_equal(angles, expected)
