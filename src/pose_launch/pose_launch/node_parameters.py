"""The ``param`` entries of a node: files, and values with ROS's typing rules.

A plain YAML value keeps its type, a quoted value is a string. The result of a substitution is
parsed as YAML (``$(var rate)`` = ``30.0`` is a number), unless ``type`` is given (``type: "str"``:
it is a string).
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pose_core.errors import InputError
from pose_core.plain_yaml import YamlError, parse_yaml
from pose_launch.document import Entity
from pose_launch.errors import LaunchError, located
from pose_launch.processes import ParameterSource
from pose_launch.substitutions import Scope, pieces_of, resolve

SCALARS: Mapping[str, type] = {"bool": bool, "int": int, "float": float, "str": str}
LIST_OF = "list_of_"
TYPES = (*SCALARS, *(f"{LIST_OF}{name}" for name in SCALARS))


def sources(entries: list[Entity], scope: Scope) -> tuple[ParameterSource, ...]:
    """Parameter files and values, in order; adjacent values are merged.

    Raises:
        LaunchError: If an entry is incomplete, or a file is missing.
    """
    found: list[ParameterSource] = []
    for entry in entries:
        file, name = entry.text("from"), entry.text("name")
        if (file is None) == (name is None):
            raise LaunchError(entry.place, "'param' needs either 'from' or 'name'")
        if file is not None:
            with located(entry.place_of("from")):
                path = Path(resolve(file, scope))
                if not path.is_file() and scope.run_commands:
                    raise InputError(f"found no parameter file {path}")
            found.append(path)
        else:
            before: Mapping[str, Any] = {}
            if found and not isinstance(found[-1], Path):
                before = found.pop()  # type: ignore[assignment]
            found.append({**before, **_values(entry, scope)})
        entry.finish()
    return tuple(found)


def _values(entry: Entity, scope: Scope) -> dict[str, Any]:
    """An entry's value by name."""
    value, kind = entry.value("value"), entry.text("type")
    with located(entry.place_of("name")):
        name = resolve(entry.required_text("name"), scope)
        if value is None:
            raise InputError(f"parameter '{name}' lacks 'value'")
    if kind is not None and kind not in TYPES:
        raise LaunchError(entry.place_of("type"), f"type '{kind}' is not one of {', '.join(TYPES)}")
    with located(entry.place_of("value")):
        return {name: _typed(name, value, kind, scope)}


def _typed(name: str, value: Any, kind: str | None, scope: Scope) -> Any:
    """A value with its substitutions resolved, of the given type, or of the one it has."""
    item_kind = None if kind is None else kind.removeprefix(LIST_OF)
    if isinstance(value, list):
        typed: Any = [_scalar(item, item_kind, scope) for item in value]
    elif kind != item_kind:
        raise InputError(
            f"parameter '{name}' is {value!r}, expected a YAML list: ros2 launch accepts a"
            " substitution that gives a list only without 'type'"
        )
    else:
        typed = _scalar(value, kind, scope)
    if isinstance(typed, list):
        if kind in SCALARS:
            raise InputError(f"parameter '{name}' is a list, expected {kind}")
        return _checked_list(name, typed, item_kind)
    if not isinstance(typed, bool | int | float | str):
        raise InputError(
            f"parameter '{name}' is {typed!r}: expected a bool, a number, a text or a list"
        )
    return typed


def _scalar(value: Any, kind: str | None, scope: Scope) -> Any:
    """Resolve the substitutions of one value, and determine or check its type."""
    if isinstance(value, str):
        pieces = pieces_of(value, scope)
        value = "".join(piece.text for piece in pieces)
        is_substituted = any(piece.is_substituted for piece in pieces)
        if kind == "str" or (kind is None and not is_substituted):
            return value
        # An empty string would be YAML's null: it stays a string.
        value = _from_yaml(value) if value.strip() else value
    if kind == "float" and type(value) is int:
        value = float(value)
    if kind is not None and type(value) is not SCALARS[kind]:
        raise InputError(f"the value {value!r} is not of type {kind}")
    return value


def _checked_list(name: str, items: list[Any], kind: str | None) -> list[Any]:
    """A list for ROS: of one type, that of ``kind`` if it is given."""
    types = {type(item) for item in items}
    if types == {int, float}:
        items, types = [float(item) for item in items], {float}
    if len(types) != 1 or not types <= set(SCALARS.values()):
        raise InputError(
            f"parameter '{name}' is {items!r}: expected a list of one type that is not empty"
            " (an empty one has no type: leave the parameter at its default)"
        )
    if kind is not None and types != {SCALARS[kind]}:
        raise InputError(f"parameter '{name}' is {items!r}, expected {LIST_OF}{kind}")
    return items


def _from_yaml(text: Any) -> Any:
    try:
        return parse_yaml(text, "the value")
    except YamlError as error:
        raise InputError(f'the value {text!r} is not YAML: is it a text (type: "str")?') from error
