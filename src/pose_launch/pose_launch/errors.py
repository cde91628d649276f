"""Errors in launch files."""

from dataclasses import dataclass
from pathlib import Path

from pose_core.errors import PoseError


@dataclass(frozen=True)
class FileLine:
    """File and line in a launch file."""

    file: Path
    line: int

    def __str__(self) -> str:
        return f"{self.file}:{self.line}"


class LaunchError(PoseError):
    """A launch file that cannot be read, or that refers to something missing."""

    def __init__(self, place: FileLine | None, message: str) -> None:
        super().__init__(message if place is None else f"{place}: {message}")
