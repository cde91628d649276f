"""A bag played through real processes gives what the offline tool makes of it."""

import numpy as np
import pytest
from ament_index_python.packages import get_package_prefix
from sensor_msgs.msg import JointState
from synthetic_body import extrinsics, kinematics, motion, skeleton_samples
from test_pose_fusion_fuse_tool import write_bag

from pose_io.bags import open_bag

EXECUTABLES = f"{get_package_prefix('pose_fusion')}/lib/pose_fusion"
STATES = "/humans/bodies/subject/joint_states"

pytestmark = [pytest.mark.graph, pytest.mark.xdist_group("live_graph")]


def test_a_played_bag_is_fused_live_as_offline(start_process, ros_context, tmp_path):
    _, dof = motion(4.5)
    positions = kinematics().pose(dof).positions
    samples = skeleton_samples(positions, extrinsics(), np.random.default_rng(60), 0.005)
    # Best effort: what comes in the moment of discovery may be lost, and here it says nothing.
    write_bag(tmp_path / "in", samples, nobody_s=1.5)
    offline = start_process([f"{EXECUTABLES}/fuse", tmp_path / "in", tmp_path / "offline"])
    assert offline.wait() == 0
    with open_bag(tmp_path / "offline") as bag:
        expected = [bag.deserialize(message) for message in bag.messages([STATES])]

    node = ros_context.make_node("listener")
    live = ros_context.collect(JointState, STATES, 1000, node)
    start_process([f"{EXECUTABLES}/fusion"])
    ros_context.spin_until(lambda: node.count_publishers(STATES), what="the fusion node")
    # Slower than it was: a busy machine loses frames that come while the node is held up.
    slowly = ["--rate", "0.4", "--wait-for-subscribers", "60"]
    player = start_process([f"{EXECUTABLES}/player", tmp_path / "in", *slowly])
    # Only the very last frames are special: offline, nobody waits for what never comes.
    ros_context.spin_until(lambda: len(live) >= len(expected) - 2, what="live joint states")
    assert player.wait() == 0
    for one, other in zip(live, expected, strict=False):
        assert one.header.stamp.sec == other.header.stamp.sec
        assert one.header.stamp.nanosec == other.header.stamp.nanosec
        np.testing.assert_array_equal(one.position, other.position)
