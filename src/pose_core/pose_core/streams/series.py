"""A person's joints over time, as arrays."""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pose_core.arrays import FloatArray, rows_between
from pose_core.joints import JOINTS, TrackingState
from pose_core.streams.samples import SkeletonSample
from pose_core.transforms import transformed

IntArray = NDArray[np.int64]
MAX_GAP_S = 0.15  # [s] longest gap to interpolate across: three missed frames at 30 Hz, none at 10
SLOWEST_S = 0.3  # [s] a longer period is a silence
GAP_PERIODS = 1.5  # [-] longest gap of a slow sensor, in periods


def longest_gap_s(period_s: float, at_least_s: float = MAX_GAP_S) -> float:
    """Longest gap [s] to interpolate across: that of fast sensors, or 1.5 periods of a slow one.

    Args:
        period_s: The sensor's usual interval [s].
        at_least_s: The gap of fast sensors [s].
    """
    return max(at_least_s, GAP_PERIODS * min(period_s, SLOWEST_S))


@dataclass(frozen=True, kw_only=True)
class SkeletonSeries:
    """One person's joints at increasing instants, in one frame."""

    stamps_ns: IntArray  # (n,) [ns], strictly increasing
    positions: FloatArray  # (n, 15, 3) [m]; NaN where unknown
    tracking_state: NDArray[np.uint8]  # (n, 15), values of TrackingState

    def __len__(self) -> int:
        return len(self.stamps_ns)

    @property
    def duration_s(self) -> float:
        """Time from the first sample to the last [s]; 0 if there are none."""
        return float(self.stamps_ns[-1] - self.stamps_ns[0]) * 1e-9 if len(self) else 0.0

    def transformed(self, T_target_source: FloatArray) -> "SkeletonSeries":
        """The series in another frame, by a (4, 4) transform."""
        return replace(self, positions=transformed(T_target_source, self.positions))

    def shifted(self, shift_s: float) -> "SkeletonSeries":
        """The series with ``shift_s`` [s] added to its stamps."""
        return replace(self, stamps_ns=self.stamps_ns + round(shift_s * 1e9))

    def between(self, begin_ns: int, end_ns: int) -> "SkeletonSeries":
        """The samples with stamps [ns] from ``begin_ns`` to ``end_ns``, inclusive."""
        return rows_between(self, begin_ns, end_ns)

    def at(self, stamps_ns: IntArray, max_gap_s: float = MAX_GAP_S) -> FloatArray:
        """Joint positions at other instants, by linear interpolation, never by extrapolation.

        Args:
            stamps_ns: The instants [ns], shape (m,).
            max_gap_s: Longest distance [s] of two samples to interpolate between.

        Returns:
            Positions [m], shape (m, 15, 3): NaN outside the series, inside longer gaps, and where
            either neighbour is NaN.
        """
        return interpolated(stamps_ns, self.stamps_ns, self.positions, max_gap_s)

    def on_grids(self, rate: float) -> list[FloatArray]:
        """Positions at a constant rate [Hz], (m, 15, 3) for each stretch without a long gap."""
        gaps = np.flatnonzero(np.diff(self.stamps_ns) > MAX_GAP_S * 1e9) + 1
        step_ns = round(1e9 / rate)
        return [
            self.at(np.arange(stretch[0], stretch[-1] + 1, step_ns, dtype=np.int64))
            for stretch in np.split(self.stamps_ns, gaps)
            if len(stretch)
        ]


def interpolated(
    wanted: IntArray, stamps_ns: IntArray, values: FloatArray, max_gap_s: float
) -> FloatArray:
    """Interpolate values linearly at other instants, never extrapolate.

    Args:
        wanted: The instants [ns], shape (m,).
        stamps_ns: Instants of the values [ns], strictly increasing, shape (n,).
        values: Shape (n, ...).
        max_gap_s: Longest distance [s] of two values to interpolate between.

    Returns:
        Shape (m, ...): NaN outside the values, inside longer gaps, and where either neighbour is
        NaN.
    """
    result = np.full((len(wanted), *values.shape[1:]), np.nan)
    after = np.searchsorted(stamps_ns, wanted)
    inside = after < len(stamps_ns)
    exact = inside.copy()
    exact[inside] = stamps_ns[after[inside]] == wanted[inside]
    result[exact] = values[after[exact]]
    between = inside & ~exact & (after > 0)
    last = after[between]
    step_ns = stamps_ns[last] - stamps_ns[last - 1]
    share = (wanted[between] - stamps_ns[last - 1]) / step_ns
    share[step_ns > max_gap_s * 1e9] = np.nan
    start = values[last - 1]
    result[between] = start + share.reshape(-1, *[1] * (values.ndim - 1)) * (values[last] - start)
    return result


def series_from_samples(samples: Iterable[SkeletonSample]) -> SkeletonSeries:
    """Make a series of samples in any order; of samples with equal stamps the first is used.

    Joints that are not tracked become NaN, whatever position they carry.
    """
    by_stamp: dict[int, SkeletonSample] = {}
    for sample in samples:
        by_stamp.setdefault(sample.stamp_ns, sample)
    ordered = [by_stamp[stamp_ns] for stamp_ns in sorted(by_stamp)]
    count = len(ordered)
    positions = np.array([s.positions for s in ordered], float).reshape(count, len(JOINTS), 3)
    state = np.array([s.tracking_state for s in ordered], np.uint8).reshape(count, len(JOINTS))
    positions[state == TrackingState.NOT_TRACKED] = np.nan
    return SkeletonSeries(
        stamps_ns=np.array([s.stamp_ns for s in ordered], np.int64),
        positions=positions,
        tracking_state=state,
    )
