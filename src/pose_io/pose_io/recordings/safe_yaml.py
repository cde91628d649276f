"""YAML that others have written: plain values only, of limited size, nothing repeated.

Aliases are refused, since a few lines of them expand to gigabytes; so is a key that stands twice,
since the first one would be lost in silence.
"""

from pathlib import Path
from typing import Any

import yaml

from pose_core.errors import InputError

MAX_BYTES = 65_536


class _PlainLoader(yaml.SafeLoader):
    """YAML's plain types, without aliases and repeated keys."""

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
        """Compose a node, unless it is an alias."""
        if self.check_event(yaml.AliasEvent):
            raise yaml.MarkedYAMLError(
                problem="an alias (*name) is not allowed", problem_mark=self.peek_event().start_mark
            )
        return super().compose_node(parent, index)

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        """Construct a mapping, unless one of its keys stands twice."""
        keys = [key.value for key, _ in node.value]
        twice = next((key for key in keys if keys.count(key) > 1), None)
        if twice is not None:
            raise yaml.MarkedYAMLError(
                problem=f"the key '{twice}' stands twice", problem_mark=node.start_mark
            )
        return super().construct_mapping(node, deep)


def read_safe_yaml(path: Path) -> Any:
    """The document in a YAML file.

    Raises:
        InputError: If the file is missing, too large, or not plain YAML.
    """
    try:
        with path.open("rb") as file:
            data = file.read(MAX_BYTES + 1)
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror}") from error
    if len(data) > MAX_BYTES:
        raise InputError(
            f"{path} is larger than {MAX_BYTES // 1024} kB: expected a short YAML file"
        )
    try:
        return yaml.load(data, _PlainLoader)
    except yaml.MarkedYAMLError as error:
        line = "" if error.problem_mark is None else f", line {error.problem_mark.line + 1}"
        raise InputError(f"{path}{line}: {error.problem}: correct the YAML") from error
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        raise InputError(f"{path} is not YAML ({type(error).__name__}): correct it") from error
