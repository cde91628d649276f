"""The ``param`` entries of a node: files, and values with ROS's typing rules.

A plain YAML value keeps its type, a quoted value is a string. The result of a substitution is
parsed as YAML (``$(var rate)`` = ``30.0`` is a number), unless ``type`` is given (``type: "str"``:
it is a string).
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pose_core.plain_yaml import YamlError, parse_yaml
from pose_launch.document import Entity
from pose_launch.errors import FileLine, LaunchError
from pose_launch.processes import ParameterSource
from pose_launch.substitutions import Scope, has_substitution, resolve

SCALARS: Mapping[str, type] = {"bool": bool, "int": int, "float": float, "str": str}
TYPES = (*SCALARS, *(f"list_of_{name}" for name in SCALARS))


def sources(entries: list[Entity], scope: Scope) -> tuple[ParameterSource, ...]:
    """Parameter files and values, in order; adjacent values are merged.

    Raises:
        LaunchError: If an entry is incomplete, or a file is missing.
    """
    found: list[ParameterSource] = []
    for entry in entries:
        file = entry.text("from")
        if (file is None) == (entry.text("name") is None):
            raise LaunchError(entry.place, "'param' needs either 'from' or 'name'")
        if file is not None:
            place = entry.place_of("from")
            path = Path(resolve(file, scope, place))
            if not path.is_file() and scope.run_commands:
                raise LaunchError(place, f"found no parameter file {path}")
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
    name = resolve(entry.required_text("name"), scope, entry.place_of("name"))
    value = entry.value("value")
    kind = entry.text("type")
    if value is None:
        raise LaunchError(entry.place, f"parameter '{name}' lacks 'value'")
    place = entry.place_of("value")
    if kind is not None and kind not in TYPES:
        raise LaunchError(entry.place_of("type"), f"type '{kind}' is not one of {', '.join(TYPES)}")
    return {name: _typed(name, value, kind, scope, place)}


def _typed(name: str, value: Any, kind: str | None, scope: Scope, place: FileLine) -> Any:
    if isinstance(value, list):
        item_kind = None if kind is None else kind.removeprefix("list_of_")
        typed: Any = [_scalar(item, item_kind, scope, place) for item in value]
    elif kind is not None and kind.startswith("list_of_"):
        text = resolve(value, scope, place) if isinstance(value, str) else value
        typed = _from_yaml(text, place)
        if not isinstance(typed, list):
            raise LaunchError(place, f"parameter '{name}' is {text!r}, expected a list")
    else:
        typed = _scalar(value, kind, scope, place)
    if isinstance(typed, list):
        return _checked_list(name, typed, kind, place)
    if not isinstance(typed, bool | int | float | str):
        raise LaunchError(
            place, f"parameter '{name}' is {typed!r}: expected a bool, a number, a text or a list"
        )
    return typed


def _scalar(value: Any, kind: str | None, scope: Scope, place: FileLine) -> Any:
    """Resolve the substitutions of one value, and determine or check its type."""
    if isinstance(value, str):
        substituted = has_substitution(value, place)
        value = resolve(value, scope, place)
        if kind == "str" or (kind is None and not substituted):
            return value
        # An empty string would be YAML's null: it stays a string.
        value = _from_yaml(value, place) if value.strip() else value
    if kind == "float" and type(value) is int:
        value = float(value)
    if kind is not None and type(value) is not SCALARS[kind]:
        raise LaunchError(place, f"the value {value!r} is not of type {kind}")
    return value


def _checked_list(name: str, items: list[Any], kind: str | None, place: FileLine) -> list[Any]:
    types = {type(item) for item in items}
    if types == {int, float}:
        items, types = [float(item) for item in items], {float}
    wanted = None if kind is None else SCALARS.get(kind.removeprefix("list_of_"))
    if kind is not None and kind in SCALARS:
        raise LaunchError(place, f"parameter '{name}' is a list, expected {kind}")
    if len(types) != 1 or not types <= set(SCALARS.values()):
        raise LaunchError(
            place,
            f"parameter '{name}' is {items!r}: expected a list of one type that is not empty"
            " (an empty one has no type: leave the parameter at its default)",
        )
    if wanted is not None and types != {wanted}:
        raise LaunchError(place, f"parameter '{name}' is {items!r}, expected {kind}")
    return items


def _from_yaml(text: Any, place: FileLine) -> Any:
    try:
        return parse_yaml(text, "the value")
    except YamlError as error:
        raise LaunchError(
            place, f'the value {text!r} is not YAML: is it a text (type: "str")?'
        ) from error
