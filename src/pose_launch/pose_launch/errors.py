"""What can be wrong with a launch file."""

from dataclasses import dataclass
from pathlib import Path

from pose_core.errors import PoseError


@dataclass(frozen=True)
class Place:
    """Where in which launch file something stands."""

    file: Path
    line: int

    def __str__(self) -> str:
        return f"{self.file}:{self.line}"


class LaunchError(PoseError):
    """A launch file that cannot be read, or that asks for what is not there."""

    def __init__(self, place: Place | None, message: str) -> None:
        super().__init__(message if place is None else f"{place}: {message}")
