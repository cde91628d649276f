"""Parameters that are misspelt or cannot be part of a topic, in a live node."""

from dataclasses import dataclass

import pytest
from rclpy.node import Node
from rclpy.parameter import Parameter

from pose_core.errors import ParameterError
from pose_core.parameters import NAME, NAME_ENDING, parameter
from pose_node.nodes.declaring import declare_parameters


@dataclass(frozen=True, kw_only=True)
class Parameters:
    rate: float = parameter(30.0, unit="Hz", doc="how often", limits=(1.0, 240.0))
    subject: str = parameter("subject", doc="whose", pattern=NAME)
    sensors: tuple[str, ...] = parameter(("left",), doc="from whom", pattern=NAME_ENDING)


def declare(ros_context, **values):
    overrides = [Parameter(name, value=value) for name, value in values.items()]
    node = ros_context.add(Node("declaring", parameter_overrides=overrides))
    return declare_parameters(node, Parameters)


def test_a_misspelt_parameter_is_refused(ros_context):
    with pytest.raises(ParameterError, match="unknown parameter raet: expected some of rate"):
        declare(ros_context, raet=50.0)


def test_parameters_common_to_all_nodes_are_accepted(ros_context):
    given = {"use_sim_time": False, "qos_overrides./parameter_events.publisher.depth": 10}
    assert declare(ros_context, **given) == Parameters()


def test_a_value_outside_its_range_is_reported_with_its_unit(ros_context):
    with pytest.raises(ParameterError) as caught:
        declare(ros_context, rate=0.5)
    assert str(caught.value) == "rate = 0.5 Hz is outside [1, 240]"


@pytest.mark.parametrize(
    ("name", "value"),
    [("subject", "a b"), ("subject", ""), ("subject", "a/b"), ("subject", "1st"), ("subject", "ü")],
)
def test_a_name_that_cannot_be_part_of_a_topic_is_refused(ros_context, name, value):
    with pytest.raises(ParameterError, match=f"{name} = '{value}' cannot be part of a ROS name"):
        declare(ros_context, **{name: value})


def test_each_name_in_a_list_is_checked(ros_context):
    assert declare(ros_context, sensors=["left", "2"]).sensors == ("left", "2")
    with pytest.raises(ParameterError, match="sensors = 'a b' cannot be part of a ROS name"):
        declare(ros_context, sensors=["left", "a b"])
