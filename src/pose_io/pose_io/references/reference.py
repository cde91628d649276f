"""Reference measurements that a recording is compared with."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from pose_core.api import AngleSeries, IntArray, SkeletonSeries, angle_series
from pose_core.arrays import FloatArray
from pose_core.errors import InputError


@dataclass(frozen=True, kw_only=True)
class Reference:
    """Reference joint angles and, unless the file has angles only, joint positions."""

    name: str  # description for reports
    synthetic: bool  # whether the subject is a simulated one
    angles: AngleSeries
    skeleton: SkeletonSeries | None  # None if the reference has angles only
    notes: tuple[str, ...] = ()  # assumptions made in reading it

    @property
    def stamps_ns(self) -> IntArray:
        """The instants [ns] of the angles, shape (n,)."""
        return self.angles.stamps_ns

    def between(self, begin_ns: int, end_ns: int) -> "Reference":
        """The part from one instant [ns] to another, both included."""
        skeleton = None if self.skeleton is None else self.skeleton.between(begin_ns, end_ns)
        return replace(self, angles=self.angles.between(begin_ns, end_ns), skeleton=skeleton)

    def shifted(self, shift_ns: int) -> "Reference":
        """The reference with ``shift_ns`` [ns] added to its stamps."""
        skeleton = self.skeleton
        if skeleton is not None:  # in integers: seconds since 1970 lose precision as floats
            skeleton = replace(skeleton, stamps_ns=skeleton.stamps_ns + shift_ns)
        return replace(self, angles=self.angles.shifted(shift_ns), skeleton=skeleton)


def reference_of_skeleton(
    name: str, skeleton: SkeletonSeries, *, synthetic: bool = False
) -> Reference:
    """A reference with joint positions."""
    return Reference(
        name=name, synthetic=synthetic, angles=angle_series(skeleton), skeleton=skeleton
    )


def text_of(path: Path) -> str:
    """A text file's contents.

    Raises:
        InputError: If it cannot be read as text.
    """
    try:
        return path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path} is not a text file, byte {error.start} is not UTF-8") from error


def numbers_of(path: Path, line: int, cells: list[str]) -> list[float]:
    """The numbers of a row, NaN for an empty cell.

    Raises:
        InputError: If a cell is not a number; the message names the line.
    """
    try:
        return [float(cell) if cell.strip() else float("nan") for cell in cells]
    except ValueError as error:
        raise InputError(f"{path}, line {line}: {error}: expected a number") from error


def padded_table(rows: Sequence[Sequence[float]], width: int) -> FloatArray:
    """Rows cut or filled with NaN to shape (n, width): hidden markers are often left out there."""
    return np.array([[*row[:width], *[np.nan] * (width - len(row))] for row in rows])
