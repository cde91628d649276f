"""Parameters declared once, as dataclass fields; everything else derives from the declaration.

A node's or tool's parameters are one frozen dataclass whose fields are made with
:func:`parameter`. The ROS descriptor, the validation, the table of the README and the
command-line options all come from it.
"""

import argparse
import dataclasses
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from pose_core.errors import InputError, ParameterError
from pose_core.plain_yaml import read_yaml

T = TypeVar("T")
NAME = r"[A-Za-z]\w*"  # a whole component of a topic name
NAME_ENDING = r"[A-Za-z0-9]\w*"  # the part of a component after an underscore
OTHER_ID = re.compile(r"person_\d+")  # ids of the people beside the subject


@dataclass(frozen=True, kw_only=True)
class ParameterSpec:
    """Specification of one parameter, except its name, type and default."""

    doc: str
    unit: str = "-"
    limits: tuple[float, float] | None = None  # smallest and largest allowed value, in `unit`
    choices: tuple[str, ...] | None = None
    pattern: str | None = None  # of the text, or of each of the texts

    @property
    def is_switch(self) -> bool:
        """Whether ``on`` and ``off``, which YAML reads as booleans, are choices."""
        return self.choices is not None and {"on", "off"} <= set(self.choices)

    @property
    def range_text(self) -> str:
        """The allowed values, as human-readable text."""
        if self.choices is not None:
            return ", ".join(self.choices)
        return "" if self.limits is None else "[{:g}, {:g}]".format(*self.limits)


def parameter(
    default: Any,
    *,
    doc: str,
    unit: str = "-",
    limits: tuple[float, float] | None = None,
    choices: Sequence[str] = (),
    pattern: str | None = None,
) -> Any:
    """Declare a parameter as a dataclass field.

    Args:
        default: A bool, int, float, str, or tuple of str; its type is the parameter's type.
        doc: One line that says what it does.
        unit: The unit, ``-`` if it has none.
        limits: Smallest and largest allowed value, in ``unit``.
        choices: The allowed strings; none: any.
        pattern: What the string, or each of them, must match to be part of topics and frames:
            :data:`NAME` or :data:`NAME_ENDING`.
    """
    spec = ParameterSpec(
        doc=doc, unit=unit, limits=limits, choices=tuple(choices) or None, pattern=pattern
    )
    return dataclasses.field(default=default, metadata={"spec": spec})


def sensors_parameter(doc: str = "names of the Kinects") -> Any:
    """Declare a node's ``sensors``."""
    return parameter(("left", "right"), doc=doc, pattern=NAME_ENDING)


def run_parameter() -> Any:
    """Declare the ``run`` of a node that keeps results; it may be empty."""
    return parameter(
        "",
        doc="name of the graph's run: a node that is restarted within a run continues with "
        "its previous results; empty: no results are kept",
        pattern=r"|[A-Za-z0-9]\w*",
    )


def specs(parameters: type | Any) -> dict[str, tuple[Any, ParameterSpec]]:
    """Default and spec of each parameter by name."""
    return {
        field.name: (field.default, field.metadata["spec"])
        for field in dataclasses.fields(parameters)
    }


def type_name(default: Any) -> str:
    """A parameter's type as ROS names it."""
    if isinstance(default, tuple):
        return "string_array"
    return {bool: "bool", int: "integer", float: "double", str: "string"}[type(default)]


def checked(name: str, value: Any, default: Any, spec: ParameterSpec) -> Any:
    """Convert a value to its declared type, or raise a :class:`ParameterError`."""
    unit = "" if spec.unit == "-" else f" {spec.unit}"
    if isinstance(default, tuple):
        return _checked_names(name, value, default, spec)
    if isinstance(default, float) and isinstance(value, int) and not isinstance(value, bool):
        value = float(value)
    if isinstance(value, bool) and spec.is_switch:
        value = "on" if value else "off"
    if type(value) is not type(default):
        raise ParameterError(f"{name} = {value!r} is not of type {type_name(default)}")
    if isinstance(value, str):
        _check_pattern(name, value, spec)
    if isinstance(value, float) and not math.isfinite(value):
        raise ParameterError(f"{name} = {value}{unit} is not finite")
    if spec.choices is not None and value not in spec.choices:
        raise ParameterError(f"{name} = {value!r} is not one of {spec.range_text}")
    if spec.limits is not None and not spec.limits[0] <= value <= spec.limits[1]:
        raise ParameterError(f"{name} = {value}{unit} is outside {spec.range_text}")
    return value


def _checked_names(
    name: str, value: Any, default: tuple[str, ...], spec: ParameterSpec
) -> tuple[str, ...]:
    value = () if value is None else value  # ROS's empty list, which has no type
    if default and value in ((), []):
        raise ParameterError(f"{name} = []: expected one name or more, or leave it out")
    if not isinstance(value, list | tuple) or not all(isinstance(v, str) for v in value):
        raise ParameterError(f"{name} = {value!r} is not a list of strings")
    for each in value:
        _check_pattern(name, each, spec)
    return tuple(value)


def _check_pattern(name: str, value: str, spec: ParameterSpec) -> None:
    if spec.pattern is not None and not re.fullmatch(spec.pattern, value, re.ASCII):
        raise ParameterError(
            f"{name} = {value!r} cannot be part of a ROS name: use letters, digits and underscores"
            + (", a letter first" if spec.pattern == NAME else "")
        )


def from_mapping(parameters: type[T], values: Mapping[str, Any]) -> T:
    """Build the dataclass from plain values, checking each; missing ones keep their default."""
    refuse_unknown(parameters, values)
    known = specs(parameters)
    return parameters(**{name: checked(name, values[name], *known[name]) for name in values})


def refuse_unknown(parameters: type, names: Iterable[Any]) -> None:
    """Raise a :class:`ParameterError` if some names are not fields of the dataclass."""
    known = specs(parameters)
    unknown = sorted(str(name) for name in set(names) - set(known))
    if unknown:
        raise ParameterError(
            f"unknown parameter {', '.join(unknown)}: expected some of {', '.join(known)}"
        )


def from_ros_yaml(parameters: type[T], path: Path, node: str) -> T:
    """Read a ROS parameter file (``/**`` and then ``node`` apply).

    Raises:
        PoseError: If the file has none for the node, or an unknown or invalid one.
    """
    return from_mapping(parameters, values_from_ros_yaml(path, node))


def values_from_ros_yaml(path: Path, node: str) -> dict[str, Any]:
    """The parameters that a ROS parameter file gives a node, unchecked.

    Raises:
        InputError: If the file cannot be read, or has no mapping ``ros__parameters`` for the node.
    """
    document = read_yaml(path, "the parameter file")
    values: dict[str, Any] = {}
    if not isinstance(document, dict):
        raise InputError(f"{path} holds no parameters: expected 'NODE: {{ros__parameters: …}}'")
    keys = ("/**", node, f"/{node}")
    if not any(key in document for key in keys):
        others = ", ".join(map(str, document)) or "nothing at all"
        raise InputError(
            f"{path} holds nothing for '{node}', only {others}: "
            f"expected '{node}: {{ros__parameters: …}}'"
        )
    for key in keys:
        section = document.get(key)
        if section is None:
            continue
        if not isinstance(section, dict) or not isinstance(section.get("ros__parameters"), dict):
            raise InputError(f"{path}: section '{key}' has no 'ros__parameters' mapping")
        values.update(section["ros__parameters"])
    return values


def add_arguments(parser: argparse._ActionsContainer, parameters: type) -> None:
    """Add one ``--option`` for each parameter, without defaults, so that only given ones count."""
    for name, (default, spec) in specs(parameters).items():
        option = "--" + name.replace("_", "-")
        unit = "" if spec.unit == "-" else f" [{spec.unit}]"
        shown = ", ".join(default) if isinstance(default, tuple) else default
        text = f"{spec.doc}{unit} (default: {shown})".replace("%", "%%")
        if isinstance(default, bool):
            parser.add_argument(
                option, action=argparse.BooleanOptionalAction, default=None, help=text
            )
        elif isinstance(default, tuple):
            parser.add_argument(option, nargs="+", metavar="NAME", help=text)
        else:
            parser.add_argument(option, type=type(default), choices=spec.choices, help=text)


def from_arguments(parameters: type[T], arguments: argparse.Namespace) -> T:
    """The dataclass from options that :func:`add_arguments` added."""
    given = {name: getattr(arguments, name, None) for name in specs(parameters)}
    return from_mapping(parameters, {k: v for k, v in given.items() if v is not None})
