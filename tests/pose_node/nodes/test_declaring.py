"""ROS parameters from their dataclass, in a live node."""

from dataclasses import dataclass

import pytest
from rclpy.node import Node
from rclpy.parameter import Parameter

from pose_core.errors import ParameterError
from pose_core.parameters import checked, parameter
from pose_node.nodes.declaring import accept_changes, declare_parameters


@dataclass(frozen=True, kw_only=True)
class Parameters:
    names: tuple[str, ...] = parameter((), doc="some names")
    rate: float = parameter(30.0, unit="Hz", doc="how often", limits=(1.0, 240.0))
    count: int = parameter(3, doc="how many")
    name: str = parameter("", doc="a name")


def declare(ros_context, **values):
    overrides = [Parameter(name, value=value) for name, value in values.items()]
    node = ros_context.add(Node("declaring", parameter_overrides=overrides))
    return declare_parameters(node, Parameters)


def test_parameters_not_given_have_their_defaults(ros_context):
    assert declare(ros_context) == Parameters()


@pytest.mark.parametrize("names", [["left"], ["left", "right"], []])
def test_a_list_whose_default_is_empty_takes_names(ros_context, names):
    assert declare(ros_context, names=names).names == tuple(names)


def test_an_empty_list_is_refused_where_one_name_is_needed():
    with pytest.raises(ParameterError, match=r"sensors = \[\]: expected one name or more"):
        checked("sensors", None, ("left",), parameter(("left",), doc="names").metadata["spec"])


def test_a_list_of_numbers_is_refused_where_names_are_expected(ros_context):
    with pytest.raises(ParameterError, match="not a list of strings"):
        declare(ros_context, names=[1, 2])


def test_a_value_outside_its_range_is_refused(ros_context):
    with pytest.raises(ParameterError, match=r"rate \[Hz\]|rate = 0.5 Hz is outside|outside"):
        declare(ros_context, rate=0.5)


def test_an_integer_is_accepted_for_a_double(ros_context):
    rate = declare(ros_context, rate=60).rate

    assert rate == 60.0
    assert isinstance(rate, float)


def test_a_text_is_accepted_for_a_list(ros_context):
    assert declare(ros_context, names="left").names == ("left",)


def test_an_integer_is_accepted_for_a_text(ros_context):
    assert declare(ros_context, name=3).name == "3"


def test_an_integer_outside_the_range_of_a_double_is_refused_by_name(ros_context):
    with pytest.raises(ParameterError, match=r"rate = 600.0 Hz is outside \[1, 240\]"):
        declare(ros_context, rate=600)


def test_a_fraction_is_refused_for_an_integer(ros_context):
    with pytest.raises(ParameterError, match="count"):
        declare(ros_context, count=2.5)


def test_a_double_may_be_set_to_an_integer_and_stays_a_double(ros_context):
    node = ros_context.add(Node("setting"))
    declare_parameters(node, Parameters, changeable=("rate",))
    heard = []
    accept_changes(node, Parameters, lambda values: heard.append(values["rate"]))

    (result,) = node.set_parameters([Parameter("rate", value=60)])

    assert result.successful
    assert heard == [60.0]
    assert node.get_parameter("rate").type_ == Parameter.Type.DOUBLE


def test_a_changed_parameter_is_validated_before_its_handler(ros_context):
    node = ros_context.add(Node("changing"))
    declare_parameters(node, Parameters, changeable=("rate",))
    heard = []
    accept_changes(node, Parameters, lambda values: heard.append(values["rate"]))

    (good,) = node.set_parameters([Parameter("rate", value=60.0)])
    (bad,) = node.set_parameters([Parameter("rate", value=600.0)])
    (fixed,) = node.set_parameters([Parameter("names", value=["left"])])

    assert (good.successful, bad.successful, fixed.successful) == (True, False, False)
    assert heard == [60.0]
