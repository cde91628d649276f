r"""Resolves the substitutions of launch files: ``$(var rate)``, ``$(env HOME)``, nested ones.

An argument is a word or is quoted; substitutions may be nested in quotes and words. A backslash
escapes the next character.
"""

import shlex
import subprocess
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from ament_index_python.packages import (
    PackageNotFoundError,
    get_package_prefix,
    get_package_share_directory,
)

from pose_launch.errors import FileLine, LaunchError


@dataclass(frozen=True)
class Call:
    """A substitution: its name and its arguments, each a template."""

    name: str
    arguments: tuple["Template", ...]


Template = tuple[str | Call, ...]


@dataclass(frozen=True, kw_only=True)
class Scope:
    """Context of substitutions."""

    variables: Mapping[str, str]
    run_commands: bool = True  # False: ``$(command …)`` gives an empty string


class _Parser:
    """Recursive descent over one text."""

    def __init__(self, text: str, place: FileLine) -> None:
        self._text = text
        self._place = place
        self._at = 0

    def whole(self) -> Template:
        template = self._template("")
        if self._at < len(self._text):
            raise self._error("is not closed")
        return template

    def _error(self, problem: str) -> LaunchError:
        return LaunchError(self._place, f"the text {self._text!r} {problem}")

    def _template(self, end: str) -> Template:
        """Everything up to one of the ``end`` characters, which is not consumed."""
        parts: list[str | Call] = []
        literal = ""
        while self._at < len(self._text) and self._text[self._at] not in end:
            if self._text.startswith("$(", self._at):
                if literal:
                    parts.append(literal)
                literal = ""
                parts.append(self._call())
                continue
            if self._text[self._at] == "\\" and self._at + 1 < len(self._text):
                self._at += 1
            literal += self._text[self._at]
            self._at += 1
        return (*parts, literal) if literal else tuple(parts)

    def _call(self) -> Call:
        self._at += len("$(")
        name = self._template(" )")
        arguments: list[Template] = []
        while self._at < len(self._text) and self._text[self._at] == " ":
            self._at += 1
            quote = self._text[self._at : self._at + 1]
            if quote in ("'", '"') and quote:
                self._at += 1
                arguments.append(self._template(quote))
                if self._at >= len(self._text):
                    raise self._error(f"has an open {quote}")
                self._at += 1
            else:
                arguments.append(self._template(" )"))
        if not self._text.startswith(")", self._at):
            raise self._error("has a '$(' without its ')'")
        self._at += 1
        if len(name) != 1 or not isinstance(name[0], str):
            raise self._error("has a '$(' without a name")
        return Call(name[0], tuple(arguments))


def parse(text: str, place: FileLine) -> Template:
    """Parse a text to a template, in which ``$(…)`` are calls."""
    return _Parser(text, place).whole()


def resolve(text: str, scope: Scope, place: FileLine) -> str:
    """Resolve all substitutions in a text.

    Raises:
        LaunchError: If a substitution is not supported, malformed, or fails.
    """
    return _resolve_template(parse(text, place), scope, place)


def has_substitution(text: str, place: FileLine) -> bool:
    """Whether the text contains any ``$(…)``."""
    return any(isinstance(part, Call) for part in parse(text, place))


def _resolve_template(template: Template, scope: Scope, place: FileLine) -> str:
    return "".join(
        part if isinstance(part, str) else _resolve_call(part, scope, place) for part in template
    )


def _resolve_call(call: Call, scope: Scope, place: FileLine) -> str:
    if call.name not in SUBSTITUTIONS:
        raise LaunchError(
            place,
            f"the substitution $({call.name} …) is not supported:"
            f" there are {', '.join(SUBSTITUTIONS)}",
        )
    expected, function = SUBSTITUTIONS[call.name]
    if len(call.arguments) != expected:
        raise LaunchError(
            place, f"$({call.name} …) has {len(call.arguments)} arguments, expected {expected}"
        )
    arguments = [_resolve_template(argument, scope, place) for argument in call.arguments]
    return function(arguments, scope, place)


def _variable(arguments: list[str], scope: Scope, place: FileLine) -> str:
    (name,) = arguments
    if name in scope.variables:
        return scope.variables[name]
    known = ", ".join(sorted(scope.variables)) or "none"
    raise LaunchError(place, f"$(var {name}): nothing of that name is set here ({known})")


def _package(
    find: Callable[[str], str],
) -> Callable[[list[str], Scope, FileLine], str]:
    def function(arguments: list[str], scope: Scope, place: FileLine) -> str:
        try:
            return find(arguments[0])
        except (PackageNotFoundError, ValueError) as error:
            raise LaunchError(
                place, f"found no package '{arguments[0]}': build and source its workspace"
            ) from error

    return function


def _command(arguments: list[str], scope: Scope, place: FileLine) -> str:
    if not scope.run_commands:
        return ""
    command = arguments[0]
    try:
        result = subprocess.run(shlex.split(command), capture_output=True, text=True)
    except (OSError, ValueError) as error:
        raise LaunchError(place, f"$(command '{command}') cannot run: {error}") from error
    if result.returncode != 0 or result.stderr:
        said = (result.stderr.strip().splitlines() or ["nothing"])[-1]
        raise LaunchError(
            place,
            f"$(command '{command}') failed: exit code {result.returncode}, it said: {said}",
        )
    return result.stdout


def _truth(text: str, place: FileLine) -> bool:
    """Truth value of a condition, by the rules of ``ros2 launch``."""
    lowered = text.strip().lower()
    if lowered in ("true", "1"):
        return True
    if lowered in ("false", "0"):
        return False
    raise LaunchError(place, f"the condition is {text!r}, expected true or false (or 1 or 0)")


def condition(text: str, scope: Scope, place: FileLine) -> bool:
    """The value of an ``if`` or ``unless``."""
    return _truth(resolve(text, scope, place), place)


SUBSTITUTIONS: dict[str, tuple[int, Callable[[list[str], Scope, FileLine], str]]] = {
    "var": (1, _variable),
    "find-pkg-share": (1, _package(get_package_share_directory)),
    "find-pkg-prefix": (1, _package(get_package_prefix)),
    "command": (1, _command),
    "equals": (2, lambda given, *_: str(given[0] == given[1]).lower()),
    "not-equals": (2, lambda given, *_: str(given[0] != given[1]).lower()),
    "not": (1, lambda given, _, place: str(not _truth(given[0], place)).lower()),
}
"""Number of arguments and function of each substitution, by name."""


def split_command_line(text: str, scope: Scope, place: FileLine) -> list[str]:
    """Split a command line into words; the result of a substitution is not split.

    Quotes group words, as in a shell.

    Raises:
        LaunchError: If a quote is not closed, or a substitution fails.
    """
    words: list[str] = []
    current: str | None = None
    for part in parse(text, place):
        if isinstance(part, Call):
            current = (current or "") + _resolve_call(part, scope, place)
            continue
        try:
            tokens = shlex.split(part)
        except ValueError as error:
            raise LaunchError(place, f"the command line {text!r}: {error}") from error
        if current is not None and (part[0].isspace() or not tokens):
            words.append(current)
            current = None
        for index, token in enumerate(tokens):
            if index > 0 and current is not None:
                words.append(current)
                current = None
            current = (current or "") + token
        if current is not None and part[-1].isspace():
            words.append(current)
            current = None
    return words if current is None else [*words, current]
