"""Whom to follow can be changed while the nodes run."""

import pytest
from rclpy.parameter import Parameter

from pose_fusion.nodes.calibration import CalibrationNode
from pose_fusion.nodes.fusion import FusionNode


@pytest.mark.parametrize(
    ("make", "rule_of"),
    [
        (FusionNode, lambda node: node.pipeline.choice.rule),
        (CalibrationNode, lambda node: node.calibration.selector.person),
    ],
    ids=["fusion", "calibration"],
)
def test_the_parameter_person_changes_the_tracked_person(ros_context, make, rule_of):
    node = ros_context.add(make())

    (result,) = node.set_parameters([Parameter("person", value="2")])

    assert result.successful
    assert rule_of(node) == "2"


def test_the_chosen_person_is_kept_over_a_time_jump_and_a_restart(
    ros_context, monkeypatch, tmp_path
):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    run = [Parameter("run", value="r1")]
    node = ros_context.add(FusionNode(parameter_overrides=run))
    node.set_parameters([Parameter("person", value="2")])

    node.restart_time()
    assert node.pipeline.choice.rule == "2"
    assert ros_context.add(FusionNode(parameter_overrides=run)).pipeline.choice.rule == "2"


@pytest.mark.parametrize("make", [FusionNode, CalibrationNode])
def test_a_person_who_cannot_be_part_of_a_name_is_refused(ros_context, make):
    node = ros_context.add(make())

    (result,) = node.set_parameters([Parameter("person", value="/x y")])

    assert not result.successful
    assert "cannot be part of a ROS name" in result.reason
    assert node.set_parameters([Parameter("person", value="")])[0].successful


def test_other_parameters_cannot_be_changed_at_run_time(ros_context):
    node = ros_context.add(FusionNode())

    (result,) = node.set_parameters([Parameter("subject", value="other")])

    assert not result.successful
