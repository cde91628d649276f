"""The person to follow can be changed while the nodes run."""

import numpy as np
import pytest
from rclpy.parameter import Parameter

from pose_core.joints import TrackingState
from pose_core.streams.person_selection import PersonSelector
from pose_core.streams.samples import SkeletonSample
from pose_fusion.nodes.calibration import CalibrationNode
from pose_fusion.nodes.fusion import FusionNode


def sample(person, x):
    return SkeletonSample(
        stamp_ns=1,
        sensor="left",
        person=person,
        positions=np.full((15, 3), x),
        tracking_state=np.full(15, TrackingState.TRACKED, np.uint8),
    )


def test_a_selector_told_to_follow_another_does_so_at_once():
    selector = PersonSelector()
    both = [sample("1", 0.0), sample("2", 5.0)]
    assert selector.select(both).person == "1"

    selector.follow("2")
    assert selector.select(both).person == "2"
    selector.follow("3")
    assert selector.select(both) is None
    selector.follow("")
    assert selector.select(both).person == "1"


@pytest.mark.parametrize(
    ("make", "selector_of"),
    [
        (FusionNode, lambda node: node._selector),
        (CalibrationNode, lambda node: node._calibration.selector),
    ],
    ids=["fusion", "calibration"],
)
def test_a_node_follows_the_person_that_is_set(ros_context, make, selector_of):
    node = ros_context.add(make())

    (result,) = node.set_parameters([Parameter("person", value="2")])

    assert result.successful
    chosen = selector_of(node).select([sample("1", 0.0), sample("2", 5.0)])
    assert chosen.person == "2"


def test_every_other_parameter_stays_as_it_was_at_the_start(ros_context):
    node = ros_context.add(FusionNode())

    (result,) = node.set_parameters([Parameter("subject", value="other")])

    assert not result.successful
