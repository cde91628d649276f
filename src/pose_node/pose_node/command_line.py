"""Start and end of every command-line tool, and checks of its arguments."""

import argparse
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from pose_core.errors import InputError, PoseError


def run_tool(main: Callable[[], int | None]) -> None:
    """Run a tool's main function and exit; a :class:`PoseError` becomes one line and status 1."""
    try:
        status = main() or 0
    except PoseError as error:
        print(f"error: {error}", file=sys.stderr)
        status = 1
    except KeyboardInterrupt:
        status = 130
    except BrokenPipeError:
        status = 141
    sys.exit(status)


def number_within(low: float, high: float, unit: str) -> Callable[[str], float]:
    """The type of an option that is a number from ``low`` to ``high``."""

    def number(text: str) -> float:
        value = float(text)
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(f"{text} {unit} is outside [{low:g}, {high:g}]")
        return value

    return number


def jobs(text: str) -> int:
    """The value of ``--jobs``.

    Raises:
        InputError: If it is not positive.
    """
    count = int(text)
    if count < 1:
        raise InputError(f"jobs = {count}: expected 1 or more")
    return count


def add_option(
    parser: argparse.ArgumentParser,
    name: str,
    default: str | float,
    meaning: str,
    metavar: str | None = None,
    **more: Any,
) -> None:
    """Declare an option with a default, which its help shows, and whose type it is if not given."""
    shown = f"{default:g}" if isinstance(default, float) else default
    more = {"type": type(default), "help": f"{meaning} (default: {shown})", **more}
    parser.add_argument(name, default=default, metavar=metavar, **more)


def add_flag(parser: argparse._ActionsContainer, name: str, meaning: str) -> None:
    """Declare an option without a value."""
    parser.add_argument(name, action="store_true", help=meaning)


def add_path(parser: argparse.ArgumentParser, name: str, metavar: str, meaning: str) -> None:
    """Declare an option that is a path, None by default."""
    parser.add_argument(name, type=Path, metavar=metavar, help=meaning)


def add_output(parser: argparse.ArgumentParser, meaning: str) -> None:
    """Declare the path that a tool writes to, which must be given."""
    parser.add_argument("-o", "--output", type=Path, required=True, help=meaning)


def check_folder_of(output: Path) -> None:
    """Raise an InputError if a file cannot be written because its folder does not exist."""
    if not output.parent.is_dir():
        raise InputError(f"cannot write {output}: its folder does not exist")
