"""Joint angles over time, as arrays, for all comparisons."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.body.joint_angles import ABDUCTION_OF, ANGLES, joint_angles, unwrapped, wrapped
from pose_core.streams.series import MAX_GAP_S, IntArray, SkeletonSeries, interpolated

SIDEWAYS = np.radians(60.0)  # [rad] of abduction: beyond it flexion is undefined
MIDDLE = np.radians(60.0)  # [rad] of the range of hips' and shoulders' flexion, −60° to 180°


@dataclass(frozen=True, kw_only=True)
class AngleSeries:
    """The twelve angles at increasing instants."""

    stamps_ns: IntArray  # (n,) [ns], strictly increasing
    angles: Mapping[str, FloatArray]  # (n,) [rad] by name, all of ANGLES; NaN where unknown

    def __len__(self) -> int:
        return len(self.stamps_ns)

    def shifted(self, shift_ns: int) -> "AngleSeries":
        """The series with ``shift_ns`` [ns] added to its stamps."""
        return AngleSeries(stamps_ns=self.stamps_ns + shift_ns, angles=self.angles)

    def between(self, begin_ns: int, end_ns: int) -> "AngleSeries":
        """The samples with stamps [ns] from ``begin_ns`` to ``end_ns``, inclusive."""
        inside = (self.stamps_ns >= begin_ns) & (self.stamps_ns <= end_ns)
        return AngleSeries(
            stamps_ns=self.stamps_ns[inside],
            angles={name: values[inside] for name, values in self.angles.items()},
        )

    def at(self, stamps_ns: IntArray, max_gap_s: float = MAX_GAP_S) -> dict[str, FloatArray]:
        """Angles at other instants, interpolated linearly on the shorter arc.

        Args:
            stamps_ns: The instants [ns], shape (m,).
            max_gap_s: Longest distance [s] of two known samples to interpolate between.

        Returns:
            Angles [rad] in (−π, π], shape (m,) each; NaN outside the series and inside longer gaps.
        """
        return {
            name: _interpolated(stamps_ns, self.stamps_ns, values, max_gap_s)
            for name, values in self.angles.items()
        }


def angle_series(series: SkeletonSeries) -> AngleSeries:
    """The twelve angles of a skeleton."""
    return AngleSeries(stamps_ns=series.stamps_ns, angles=joint_angles(series.positions))


def without_sideways_flexion(angles: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
    """The angles [rad] by name, (n,) each, with NaN for flexion where abduction exceeds 60°."""
    result = dict(angles)
    for flexion, abduction in ABDUCTION_OF.items():
        with np.errstate(invalid="ignore"):
            result[flexion] = np.where(
                np.abs(angles[abduction]) > SIDEWAYS, np.nan, angles[flexion]
            )
    return result


def angle_columns(angles: Mapping[str, FloatArray]) -> FloatArray:
    """The angles [rad] side by side, as :func:`anatomical`, shape (n, 12)."""
    return np.stack([anatomical(angles[name]) for name in ANGLES], axis=1)


def anatomical(angle: FloatArray) -> FloatArray:
    """Angles [rad] of any shape modulo 2π, in [−120°, 240°).

    Hips and shoulders bend from −60° to 180°, so no motion crosses the ends of this interval,
    except where the limb points sideways. Unwrapping would count such a crossing as a turn of 360°.
    """
    return MIDDLE + wrapped(angle - MIDDLE)


def _interpolated(
    wanted: IntArray, stamps_ns: IntArray, values: FloatArray, max_gap_s: float
) -> FloatArray:
    known = np.isfinite(values)
    return -wrapped(-interpolated(wanted, stamps_ns[known], unwrapped(values[known]), max_gap_s))
