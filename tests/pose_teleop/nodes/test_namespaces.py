"""Two graphs in two namespaces do not receive each other's messages."""

import pytest

from pose_fusion.nodes.calibration import CalibrationNode
from pose_fusion.nodes.fusion import FusionNode
from pose_teleop.nodes.arm import ArmNode
from pose_teleop.nodes.hri import HriNode
from pose_teleop.nodes.retarget import RetargetNode
from pose_teleop.nodes.simulated_robot import SimulatedRobot

SHARED = {"/diagnostics", "/rosout", "/parameter_events", "/clock"}
NODES = (FusionNode, CalibrationNode, ArmNode, HriNode, RetargetNode, SimulatedRobot)


@pytest.mark.parametrize("make", NODES)
def test_all_topics_of_a_node_are_in_its_namespace(ros_context, make):
    node = ros_context.add(make(namespace="first"))
    found = set()

    def listed():
        named = (node.get_name(), node.get_namespace())
        for entries in (
            node.get_publisher_names_and_types_by_node(*named),
            node.get_subscriber_names_and_types_by_node(*named),
        ):
            found.update(topic for topic, _ in entries)
        return len(found) > 3

    ros_context.spin_until(listed)
    assert {t for t in found - SHARED if not t.startswith("/first/")} == set()
