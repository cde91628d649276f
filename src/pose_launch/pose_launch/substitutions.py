r"""Resolves the substitutions of launch files: ``$(var rate)``, ``$(command …)``, nested ones.

An argument is a word or is quoted; substitutions may be nested in quotes and words. A backslash
escapes the next character. All functions raise an :class:`InputError` if a substitution is not
supported, malformed, or fails.
"""

import shlex
import subprocess
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

from ament_index_python.packages import get_package_prefix, get_package_share_directory

from pose_core.errors import InputError
from pose_node.child_process import of_package

FIRST_MARK = 0xF0000  # private characters, which stand for substitutions while words are split


@dataclass(frozen=True, kw_only=True)
class Scope:
    """Context of substitutions."""

    variables: Mapping[str, str]
    run_commands: bool = True  # False: ``$(command …)`` gives an empty string


class Piece(NamedTuple):
    """A part of a resolved text."""

    text: str
    is_substituted: bool


class _Resolver:
    """Recursive descent over one text."""

    def __init__(self, text: str, scope: Scope) -> None:
        self._text = text
        self._scope = scope
        self._at = 0

    def pieces(self, end: str = "") -> list[Piece]:
        """Everything up to one of the ``end`` characters, which is not consumed."""
        pieces: list[Piece] = []
        literal = ""
        while self._at < len(self._text) and self._text[self._at] not in end:
            if self._text.startswith("$(", self._at):
                if literal:
                    pieces.append(Piece(literal, False))
                literal = ""
                pieces.append(Piece(self._substitution(), True))
                continue
            if self._text[self._at] == "\\" and self._at + 1 < len(self._text):
                self._at += 1
            literal += self._text[self._at]
            self._at += 1
        return [*pieces, Piece(literal, False)] if literal else pieces

    def _error(self, problem: str) -> InputError:
        return InputError(f"the text {self._text!r} {problem}")

    def _substitution(self) -> str:
        self._at += len("$(")
        name = self.pieces(" )")
        arguments: list[str] = []
        while self._at < len(self._text) and self._text[self._at] == " ":
            self._at += 1
            quote = self._text[self._at : self._at + 1]
            if quote in ("'", '"'):
                self._at += 1
                start = self._at
                arguments.append(_joined(self.pieces(quote)))
                if self._at >= len(self._text):
                    raise self._error(f"has an open {quote}")
                if self._at == start:
                    raise self._error(
                        f"has an argument {2 * quote}, which ros2 launch reads as []:"
                        " compare x$(…) with x"
                    )
                self._at += 1
            else:
                arguments.append(_joined(self.pieces(" )")))
        if not self._text.startswith(")", self._at):
            raise self._error("has a '$(' without its ')'")
        self._at += 1
        if len(name) != 1 or name[0].is_substituted:
            raise self._error("has a '$(' without a name")
        return _substituted(name[0].text, arguments, self._scope)


def pieces_of(text: str, scope: Scope) -> list[Piece]:
    """The parts of a text, with all substitutions resolved."""
    return _Resolver(text, scope).pieces()


def resolve(text: str, scope: Scope) -> str:
    """Resolve all substitutions in a text."""
    return _joined(pieces_of(text, scope))


def _joined(pieces: list[Piece]) -> str:
    return "".join(piece.text for piece in pieces)


def _substituted(name: str, arguments: list[str], scope: Scope) -> str:
    if name not in SUBSTITUTIONS:
        raise InputError(
            f"the substitution $({name} …) is not supported: there are {', '.join(SUBSTITUTIONS)}"
        )
    expected, function = SUBSTITUTIONS[name]
    if len(arguments) != expected:
        raise InputError(f"$({name} …) has {len(arguments)} arguments, expected {expected}")
    return function(arguments, scope)


def _variable(arguments: list[str], scope: Scope) -> str:
    (name,) = arguments
    if name in scope.variables:
        return scope.variables[name]
    known = ", ".join(sorted(scope.variables)) or "none"
    raise InputError(f"$(var {name}): nothing of that name is set here ({known})")


def _command(arguments: list[str], scope: Scope) -> str:
    if not scope.run_commands:
        return ""
    command = arguments[0]
    try:
        result = subprocess.run(shlex.split(command), capture_output=True, text=True)
    except (OSError, ValueError) as error:
        raise InputError(f"$(command '{command}') cannot run: {error}") from error
    if result.returncode != 0 or result.stderr:
        said = (result.stderr.strip().splitlines() or ["nothing"])[-1]
        raise InputError(
            f"$(command '{command}') failed: exit code {result.returncode}, it said: {said}"
        )
    return result.stdout


def _truth(text: str) -> bool:
    """Truth value of a condition, by the rules of ``ros2 launch``."""
    lowered = text.strip().lower()
    if lowered in ("true", "1"):
        return True
    if lowered in ("false", "0"):
        return False
    raise InputError(f"the condition is {text!r}, expected true or false (or 1 or 0)")


def condition(text: str, scope: Scope) -> bool:
    """The value of an ``if`` or ``unless``."""
    return _truth(resolve(text, scope))


SUBSTITUTIONS: dict[str, tuple[int, Callable[[list[str], Scope], str]]] = {
    "var": (1, _variable),
    "find-pkg-share": (1, lambda given, _: of_package(get_package_share_directory, *given)),
    "find-pkg-prefix": (1, lambda given, _: of_package(get_package_prefix, *given)),
    "command": (1, _command),
    "equals": (2, lambda given, _: str(given[0] == given[1]).lower()),
    "not-equals": (2, lambda given, _: str(given[0] != given[1]).lower()),
    "not": (1, lambda given, _: str(not _truth(given[0])).lower()),
}
"""Number of arguments and function of each substitution, by name."""


def split_command_line(text: str, scope: Scope) -> list[str]:
    """Split a command line into words; the result of a substitution is not split.

    Quotes group words, as in a shell.
    """
    pieces = pieces_of(text, scope)
    marks = {chr(FIRST_MARK + n): each.text for n, each in enumerate(pieces) if each.is_substituted}
    marked = (
        chr(FIRST_MARK + n) if each.is_substituted else each.text for n, each in enumerate(pieces)
    )
    try:
        words = shlex.split("".join(marked))
    except ValueError as error:
        raise InputError(f"the command line {text!r}: {error}") from error
    return ["".join(marks.get(character, character) for character in word) for word in words]
