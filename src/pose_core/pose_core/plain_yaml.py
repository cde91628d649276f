"""The only reader of YAML: plain values of limited size and depth, no aliases, no repeated keys.

A few lines of aliases can expand to gigabytes, deep nesting can crash the interpreter, and a
repeated key would silently lose its first value. All of these are refused.
"""

from collections.abc import Hashable
from pathlib import Path
from typing import Any

import yaml

from pose_core.errors import InputError

MAX_BYTES = 262_144  # [bytes] a session file of four cameras has less than 20,000
MAX_DEPTH = 32  # [-] launch files nest 12 deep


class PlainLoader(yaml.SafeLoader):
    """Loader of YAML's plain types within limits; base class of loaders that need more."""

    def __init__(self, stream: Any) -> None:
        super().__init__(stream)
        self._depth = 0

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
        """Compose a node, unless it is an alias or too deep."""
        if self.check_event(yaml.AliasEvent):
            self._refuse("an alias (*name) is not allowed: write the value out")
        if self._depth >= MAX_DEPTH:
            self._refuse(f"more than {MAX_DEPTH} levels are nested")
        self._depth += 1
        node = super().compose_node(parent, index)
        self._depth -= 1
        return node

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Hashable, Any]:
        """Construct a mapping, unless one of its keys is repeated."""
        seen = set()
        for key_node, _ in node.value:
            key = self.construct_object(key_node, deep=True)
            if not isinstance(key, Hashable) or key in seen:
                what = "occurs twice" if isinstance(key, Hashable) else "cannot be a key"
                raise yaml.MarkedYAMLError(
                    problem=f"'{key}' {what}", problem_mark=key_node.start_mark
                )
            seen.add(key)
        return super().construct_mapping(node, deep)

    def _refuse(self, problem: str) -> None:
        mark = self.peek_event().start_mark  # type: ignore[no-untyped-call,unused-ignore]
        raise yaml.MarkedYAMLError(problem=problem, problem_mark=mark)


class PlainDumper(yaml.SafeDumper):
    """Writes YAML for this reader: repeated values are written out, without aliases."""

    def ignore_aliases(self, data: Any) -> bool:
        """Never use aliases."""
        del data
        return True


class YamlError(InputError):
    """Text that is not plain YAML.

    Attributes:
        problem: What is wrong, without the position.
        line: Line number, from 1.
    """

    def __init__(self, where: str, problem: str, line: int = 1) -> None:
        super().__init__(f"{where} is not plain YAML: line {line}: {problem}")
        self.problem, self.line = problem, line


def parse_yaml(text: str | bytes, where: str, loader: type[PlainLoader] = PlainLoader) -> Any:
    """The document in a text.

    Args:
        text: The YAML.
        where: Name of the source, for error messages.
        loader: The loader's class.

    Raises:
        YamlError: If it is too large, or no plain YAML.
    """
    if len(text) > MAX_BYTES:
        raise YamlError(where, f"larger than {MAX_BYTES // 1024} kB: expected a short file")
    try:
        return yaml.load(text, loader)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark
        problem = " ".join(str(error.problem or error).split())
        raise YamlError(where, problem, 1 if mark is None else mark.line + 1) from error
    except yaml.YAMLError as error:
        raise YamlError(where, " ".join(str(error).split())) from error
    except (ValueError, TypeError, ArithmeticError, RecursionError) as error:
        # A date, number or binary that its type cannot hold.
        raise YamlError(where, f"a value cannot be read ({error})") from error


def read_yaml(path: Path, what: str, loader: type[PlainLoader] = PlainLoader) -> Any:
    """The document in a file.

    Args:
        path: The file.
        what: What it should contain, for error messages: "the calibration".
        loader: The loader's class.

    Raises:
        InputError: If it cannot be read, is too large, or no plain YAML.
    """
    try:
        with path.open("rb") as file:
            data = file.read(MAX_BYTES + 1)
    except (OSError, ValueError) as error:  # ValueError: a NUL in the path
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(f"cannot read {what} {path}: {reason}") from error
    return parse_yaml(data, str(path), loader)


def dump_yaml(document: Any, **style: Any) -> str:
    """A document as text; keys in their order.

    Args:
        document: Plain values.
        **style: Of ``yaml.dump``.
    """
    return yaml.dump(document, Dumper=PlainDumper, sort_keys=False, **style)
