"""Reads a YAML launch file into entities with line numbers.

``ros2 launch`` requires strings for textual attributes (``default: "2.5"``, not ``2.5``); an entity
requires the same, so that a file which is valid here is valid there.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any, TypeVar

import yaml

from pose_core.plain_yaml import PlainLoader, YamlError, read_yaml
from pose_launch.errors import FileLine, LaunchError

T = TypeVar("T")


class LocatedMapping(dict[Any, Any]):
    """A YAML mapping with the lines of its keys."""

    lines: dict[str, int]
    line: int


class _Loader(PlainLoader):
    pass


def _construct_mapping(loader: _Loader, node: yaml.MappingNode) -> LocatedMapping:
    mapping = LocatedMapping(loader.construct_mapping(node, deep=True))
    mapping.line = node.start_mark.line + 1
    mapping.lines = {loader.construct_object(key): key.start_mark.line + 1 for key, _ in node.value}
    return mapping


_Loader.add_constructor(yaml.resolver.BaseResolver.DEFAULT_MAPPING_TAG, _construct_mapping)


class Entity:
    """An action of a launch file, or a part of one: a kind, attributes, children.

    Args:
        kind: The action's name, for example ``node``.
        element: Its attributes (a mapping) or its children (a list).
        place: Its file and line.

    Raises:
        LaunchError: By every method, with file and line, if the file does not have what is read.
    """

    def __init__(self, kind: str, element: Any, place: FileLine) -> None:
        if not isinstance(element, LocatedMapping | list):
            raise LaunchError(
                place, f"'{kind}' holds {element!r}: expected attributes (a mapping) or a list"
            )
        self.kind = kind
        self.place = place
        self._element = element
        self._attributes = element if isinstance(element, LocatedMapping) else LocatedMapping()
        self._known: set[str] = set()

    def place_of(self, name: str) -> FileLine:
        """File and line of an attribute."""
        if name in self._attributes:
            return FileLine(self.place.file, self._attributes.lines[name])
        return self.place

    def value(self, name: str) -> Any:
        """Value of an attribute in YAML, None if it is missing."""
        self._known.add(name)
        return self._attributes.get(name)

    def text(self, name: str) -> str | None:
        """Value of a textual attribute, None if it is missing."""
        return self._typed(name, str, ", not a text: put it in quotes")

    def required_text(self, name: str) -> str:
        """Value of a required textual attribute."""
        value = self.text(name)
        if value is None:
            raise LaunchError(self.place, f"'{self.kind}' lacks '{name}'")
        return value

    def number(self, name: str) -> float | None:
        """Value of a floating-point attribute (required by ``ros2 launch``), None if missing."""
        expected = "a number with a point, such as 1.0, without quotes ('ros2 launch' insists)"
        return self._typed(name, float, f": expected {expected}")

    def _typed(self, name: str, kind: type[T], else_say: str) -> T | None:
        """Value of an attribute of this type, None if it is missing."""
        value = self.value(name)
        if value is not None and not isinstance(value, kind):
            raise LaunchError(
                self.place_of(name), f"'{name}' of '{self.kind}' is {value!r}{else_say}"
            )
        return value

    def parts(self, name: str) -> list["Entity"]:
        """An attribute that is a list of mappings, such as ``param``."""
        value = self.value(name)
        if value is None:
            return []
        if not isinstance(value, list) or not all(isinstance(v, LocatedMapping) for v in value):
            raise LaunchError(
                self.place_of(name), f"'{name}' of '{self.kind}' is not a list of mappings"
            )
        return [Entity(name, part, FileLine(self.place.file, part.line)) for part in value]

    def children(self) -> Iterator["Entity"]:
        """The actions inside, given as a list or under ``children``."""
        self._known.add("children")
        element = self._element
        children = element.get("children") if isinstance(element, LocatedMapping) else element
        if not isinstance(children, list):
            raise LaunchError(
                self.place, f"'{self.kind}' holds no list of actions (under 'children')"
            )
        for child in children:
            is_mapping = isinstance(child, LocatedMapping)
            place = FileLine(self.place.file, child.line) if is_mapping else self.place
            if not is_mapping or len(child) != 1:
                raise LaunchError(
                    place, f"{child!r} is not one action: expected for example '- node: {{…}}'"
                )
            ((kind, element),) = child.items()
            yield Entity(kind, element, place)

    def finish(self) -> None:
        """Raise a LaunchError if there are unknown attributes."""
        unknown = [name for name in self._attributes if name not in self._known]
        if unknown:
            raise LaunchError(
                self.place_of(unknown[0]),
                f"'{self.kind}' has '{unknown[0]}', which is not supported:"
                f" there are {', '.join(sorted(self._known))}",
            )


def read_launch_file(path: Path) -> Entity:
    """The root entity of a launch file.

    Raises:
        PoseError: If there is no such file, or it is not a YAML launch file.
    """
    try:
        document = read_yaml(path, "the launch file", _Loader)
    except YamlError as error:
        raise LaunchError(FileLine(path, error.line), f"not valid YAML: {error.problem}") from error
    if not isinstance(document, LocatedMapping) or list(document) != ["launch"]:
        raise LaunchError(
            FileLine(path, 1), "not a ROS 2 YAML launch file: expected 'launch:' and a list"
        )
    return Entity("launch", document["launch"], FileLine(path, document.lines["launch"]))
