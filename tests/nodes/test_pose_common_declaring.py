"""ROS parameters from their dataclass, in a live node."""

from dataclasses import dataclass

import pytest
from rclpy.node import Node
from rclpy.parameter import Parameter

from pose_core.errors import ParameterError
from pose_core.parameters import parameter
from pose_node.nodes.declaring import accept_changes, declare_parameters


@dataclass(frozen=True, kw_only=True)
class Parameters:
    names: tuple[str, ...] = parameter((), doc="some names")
    rate: float = parameter(30.0, unit="Hz", doc="how often", low=1.0, high=240.0)


def declare(ros_context, **values):
    overrides = [Parameter(name, value=value) for name, value in values.items()]
    node = ros_context.add(Node("declaring", parameter_overrides=overrides))
    return declare_parameters(node, Parameters)


def test_defaults_hold_where_nothing_is_given(ros_context):
    assert declare(ros_context) == Parameters()


@pytest.mark.parametrize("names", [["left"], ["left", "right"], []])
def test_a_list_whose_default_is_empty_takes_names(ros_context, names):
    assert declare(ros_context, names=names).names == tuple(names)


def test_a_list_of_numbers_is_refused_where_names_are_expected(ros_context):
    with pytest.raises(ParameterError, match="not a list of strings"):
        declare(ros_context, names=[1, 2])


def test_a_value_outside_its_range_is_refused(ros_context):
    with pytest.raises(ParameterError, match=r"rate \[Hz\]|rate = 0.5 Hz is outside|outside"):
        declare(ros_context, rate=0.5)


def test_a_changeable_parameter_reaches_its_handler_checked(ros_context):
    node = ros_context.add(Node("changing"))
    declare_parameters(node, Parameters, changeable=("rate",))
    heard = []
    accept_changes(node, Parameters, {"rate": heard.append})

    (good,) = node.set_parameters([Parameter("rate", value=60.0)])
    (bad,) = node.set_parameters([Parameter("rate", value=600.0)])
    (fixed,) = node.set_parameters([Parameter("names", value=["left"])])

    assert (good.successful, bad.successful, fixed.successful) == (True, False, False)
    assert heard == [60.0]
