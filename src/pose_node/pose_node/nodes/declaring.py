"""Declaration of ROS parameters from a dataclass."""

from collections.abc import Callable, Collection, Mapping
from typing import Any, TypeVar

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.exceptions import InvalidParameterTypeException, InvalidParameterValueException
from rclpy.node import Node
from rclpy.parameter import Parameter

from pose_core.errors import ParameterError, PoseError
from pose_core.parameters import ParameterSpec, checked, from_mapping, refuse_unknown, specs

T = TypeVar("T")
LIMIT = 1e300  # ROS ranges have two ends
OF_EVERY_NODE = ("use_sim_time", "start_type_description_service")
QOS_OVERRIDES = "qos_overrides."


def overrides_of(parameters: type, options: Mapping[str, Any]) -> list[Parameter]:
    """ROS parameters from a command line's options; those that were not given are None."""
    given = {name: options[name] for name in specs(parameters)}
    return [Parameter(name, value=value) for name, value in given.items() if value is not None]


def declare_parameters(
    node: Node,
    parameters: type[T],
    changeable: Collection[str] = (),
    of_others: Collection[str] = (),
) -> T:
    """Declare each field as a ROS parameter and return the checked values.

    Args:
        node: The node to declare them on.
        parameters: The dataclass.
        changeable: The ones that are not read-only.
        of_others: Names that the node declares elsewhere.

    Returns:
        The dataclass, filled.

    Raises:
        ParameterError: If a value is not allowed, or a parameter is none of the node's.
    """
    # rclpy passes over what is set but never declared, and has no public way to ask for it.
    given = node._parameter_overrides
    known = specs(parameters)
    given.update({name: as_declared(value, known) for name, value in given.items()})
    elsewhere = {*OF_EVERY_NODE, *of_others}
    ours = [n for n in given if n not in elsewhere and not n.startswith(QOS_OVERRIDES)]
    refuse_unknown(parameters, ours)
    values = {}
    for name, (default, spec) in known.items():
        plain = list(default) if isinstance(default, tuple) else default
        try:
            descriptor = descriptor_of(default, spec)
            descriptor.read_only = name not in changeable
            values[name] = node.declare_parameter(name, plain, descriptor).value
        except InvalidParameterTypeException as error:
            raise ParameterError(f"{name}: {error}") from error
        except InvalidParameterValueException as error:
            checked(name, given[name].value, default, spec)  # says it in our words
            raise ParameterError(f"{name} is outside {spec.range_text}: {error}") from error
    # `ros2 param set NODE rate 10`, too. One a node: what several of these return adds up.
    node.add_pre_set_parameters_callback(
        lambda changes: [as_declared(change, known) for change in changes]
    )
    return from_mapping(parameters, values)


def as_declared(given: Parameter, known: Mapping[str, tuple[Any, ParameterSpec]]) -> Parameter:
    """Convert a parameter to its declared type.

    An integer is accepted for a double or a text, a text for a list of texts.
    """
    default, _ = known.get(given.name, (None, None))
    if isinstance(default, float | str) and given.type_ == Parameter.Type.INTEGER:
        return Parameter(given.name, value=type(default)(given.value))
    if isinstance(default, tuple) and given.type_ == Parameter.Type.STRING:
        return Parameter(given.name, value=[given.value])
    return given


def accept_changes(node: Node, parameters: type, change: Callable[[dict[str, Any]], None]) -> None:
    """Accept parameters that are set while the node runs.

    Args:
        node: The node that has declared them.
        parameters: The dataclass that says which values are allowed.
        change: Gets the new values by name, and raises a PoseError to refuse them.
    """
    known = specs(parameters)

    def on_set(changes: list[Parameter]) -> SetParametersResult:
        ours = [change for change in changes if change.name in known]
        try:
            change({c.name: checked(c.name, c.value, *known[c.name]) for c in ours})
        except PoseError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    node.add_on_set_parameters_callback(on_set)


def descriptor_of(default: Any, spec: ParameterSpec) -> ParameterDescriptor:
    """Descriptor of a parameter for ROS; read-only."""
    unit = "" if spec.unit == "-" else f" [{spec.unit}]"
    descriptor = ParameterDescriptor(
        description=spec.doc + unit, additional_constraints=spec.range_text, read_only=True
    )
    # `off` comes as a boolean, which `from_mapping` mends. ROS takes an empty list for one of bytes
    # and would then refuse texts; `from_mapping` checks the type all the same.
    descriptor.dynamic_typing = spec.is_switch or default == ()
    if spec.limits is not None:
        low, high = max(spec.limits[0], -LIMIT), min(spec.limits[1], LIMIT)
        if isinstance(default, float):
            bounds = FloatingPointRange(from_value=float(low), to_value=float(high))
            descriptor.floating_point_range = [bounds]
        else:
            descriptor.integer_range = [IntegerRange(from_value=int(low), to_value=int(high))]
    return descriptor
