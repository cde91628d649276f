"""Errors in launch files."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from pose_core.errors import InputError, PoseError


@dataclass(frozen=True)
class FileLine:
    """File and line in a launch file."""

    file: Path
    line: int

    def __str__(self) -> str:
        return f"{self.file}:{self.line}"


class LaunchError(PoseError):
    """A launch file that cannot be read, or that refers to something missing."""

    def __init__(self, place: FileLine, message: str) -> None:
        super().__init__(f"{place}: {message}")


@contextmanager
def located(place: FileLine) -> Iterator[None]:
    """Context manager around code that evaluates what stands at a place.

    Raises:
        LaunchError: For an :class:`InputError`, with the place.
    """
    try:
        yield
    except InputError as error:
        raise LaunchError(place, str(error)) from error
