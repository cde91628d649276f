r"""The offset between two sensors' clocks, from the motion that both saw.

The offset is the shift :math:`\tau` of one sensor's stamps under which its skeletons agree best
with the other's, each shift with the rigid transform that suits it best:

.. math:: \min_\tau \min_{R, t} \sum \rho(\| a(s) - (R\,b(s + \tau) + t) \|)

and then refined by each joint's own delay (:mod:`joint_delays`).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from pose_common.joints import JOINTS, TrackingState
from pose_fusion.calibration.joint_delays import CORRELATION_S, Delay, estimate_delay
from pose_fusion.calibration.rigid_transform import (
    CalibrationError,
    estimate_rigid_transform_robustly,
    transformed,
)
from pose_fusion.streams.samples import FloatArray, SkeletonSample

NS_PER_S = 1_000_000_000
COARSE_STEP_S = 0.04  # [s] about a frame
FINE_REACH_S = 0.08  # [s] about the best coarse shift
FINE_TOLERANCE_S = 0.0005  # [s]
MAX_FRAMES = 300  # [-] of the reference that are compared
MIN_FRAMES = 30  # [-] compared under every shift
UNKNOWN_M = 1000.0  # [m] a residual worse than any, and finite for the search
KERNEL = np.array([1.0, 2.0, 3.0, 2.0, 1.0]) / 9.0  # [-] weights of neighbouring samples
MAX_GAP_S = 0.1  # [s] to interpolate across
REFINEMENTS = 3  # [-] of the offset by the joints' delays
JOINT_ERROR_M = 0.02  # [m] that no calibration removes
SPEED_REACH = 5  # [-] samples to either side: a shorter way is mostly noise
OBSERVABLE_STDDEV_S = 0.017  # [s] half a frame: beyond, no offset is better than a wrong one
SIGNIFICANT = 2.0  # [-] standard deviations; a smaller offset is taken for none


@dataclass(frozen=True, kw_only=True)
class ClockOffset:
    """How far one sensor's clock is ahead of the reference's."""

    estimate_s: float  # [s]
    stddev_s: float  # [s] infinite where too little was seen

    @property
    def observable(self) -> bool:
        """Whether the motion sufficed to tell."""
        return self.stddev_s <= OBSERVABLE_STDDEV_S

    @property
    def offset_ns(self) -> int:
        """What to subtract from the sensor's stamps [ns]: 0 unless it is significant."""
        is_significant = abs(self.estimate_s) > SIGNIFICANT * self.stddev_s
        return round(self.estimate_s * NS_PER_S) if self.observable and is_significant else 0


UNKNOWN_OFFSET = ClockOffset(estimate_s=0.0, stddev_s=np.inf)


@dataclass(frozen=True)
class _Track:
    """One sensor's joints over time."""

    stamps: FloatArray  # (n,) [s]
    positions: FloatArray  # (n, 15, 3) [m], NaN if not tracked

    def at(self, stamps: FloatArray) -> FloatArray:
        """Joints at other instants [s], interpolated; NaN in gaps and outside, shape (m, 15, 3)."""
        after = np.clip(np.searchsorted(self.stamps, stamps), 1, len(self.stamps) - 1)
        before = after - 1
        step = self.stamps[after] - self.stamps[before]
        share = (stamps - self.stamps[before]) / step
        positions = self.positions[before] + share[:, None, None] * (
            self.positions[after] - self.positions[before]
        )
        outside = (share < 0.0) | (share > 1.0) | (step > MAX_GAP_S)
        positions[outside] = np.nan
        return positions


def estimate_clock_offset(
    reference: Sequence[SkeletonSample], other: Sequence[SkeletonSample], max_offset_s: float = 0.5
) -> ClockOffset:
    """Find how far another sensor's clock is ahead of the reference's.

    Args:
        reference: One person's samples, stamps ascending.
        other: The same person's from the other sensor, stamps ascending.
        max_offset_s: Largest offset [s] to look for.

    Returns:
        The offset; of infinite deviation where the person moved too little or was seen too briefly.
    """
    if not reference or not other:
        return UNKNOWN_OFFSET
    begin_ns = reference[0].stamp_ns
    a, b = _track(reference, begin_ns), _track(other, begin_ns)
    if min(len(a.stamps), len(b.stamps)) < MIN_FRAMES:
        return UNKNOWN_OFFSET
    compared = _moving_frames(a)
    shifts = np.arange(-max_offset_s, max_offset_s + 0.5 * COARSE_STEP_S, COARSE_STEP_S)
    medians = [_median_residual(a, b, compared, shift) for shift in shifts]
    best = shifts[int(np.argmin(medians))]
    fine = minimize_scalar(
        lambda shift: _median_residual(a, b, compared, float(shift)),
        bounds=(best - FINE_REACH_S, best + FINE_REACH_S),
        method="bounded",
        options={"xatol": FINE_TOLERANCE_S},
    )
    if fine.fun >= UNKNOWN_M or abs(fine.x) > max_offset_s:  # a best at the edge is none
        return UNKNOWN_OFFSET
    offset, stddev = float(fine.x), _stddev(a, compared, float(fine.fun))
    if stddev > OBSERVABLE_STDDEV_S:
        return ClockOffset(estimate_s=offset, stddev_s=stddev)
    for _ in range(REFINEMENTS):
        delay = _delay(a, b, offset)
        offset, stddev = offset + delay.estimate_s, delay.stddev_s
    if abs(offset - fine.x) > FINE_REACH_S:
        return UNKNOWN_OFFSET
    return ClockOffset(estimate_s=offset, stddev_s=stddev)


def _delay(a: _Track, b: _Track, offset: float) -> Delay:
    """What is left of the other's delay after an offset [s] has been taken off."""
    moved = b.at(a.stamps + offset)
    known = np.isfinite(a.positions + moved).all(axis=2)
    try:
        fit = estimate_rigid_transform_robustly(moved[known], a.positions[known])
    except CalibrationError:
        return Delay(estimate_s=0.0, stddev_s=np.inf)
    positions = a.positions.copy()
    outlier = known.copy()
    outlier[known] = fit.weights == 0.0
    positions[outlier] = np.nan
    return estimate_delay(a.stamps, positions, transformed(fit.T_target_source, moved))


def _track(samples: Sequence[SkeletonSample], begin_ns: int) -> _Track:
    stamps_ns = np.array([sample.stamp_ns - begin_ns for sample in samples])
    positions = np.array([sample.positions for sample in samples])
    state = np.array([sample.tracking_state for sample in samples])
    positions[state != TrackingState.TRACKED] = np.nan
    ascending = np.concatenate([[True], np.diff(stamps_ns) > 0])
    return _smoothed(stamps_ns[ascending] / NS_PER_S, positions[ascending])


def _smoothed(stamps: FloatArray, positions: FloatArray) -> _Track:
    """Weighted means of neighbouring samples, and of their stamps.

    Interpolation halfway between two noisy samples halves the variance of their noise: without
    smoothing, shifts that lead there for most samples would agree best, whatever the motion.
    """
    count = len(stamps) - len(KERNEL) + 1
    if count < 1:
        return _Track(np.empty(0), np.empty((0, len(JOINTS), 3)))
    windows = [slice(first, first + count) for first in range(len(KERNEL))]
    mean_stamps = sum(w * stamps[part] for w, part in zip(KERNEL, windows, strict=True))
    mean = sum(w * positions[part] for w, part in zip(KERNEL, windows, strict=True))
    pause = np.maximum.reduce([np.diff(stamps)[part] for part in windows[:-1]]) > MAX_GAP_S
    mean = np.where(pause[:, None, None], np.nan, mean)
    return _Track(np.asarray(mean_stamps), mean)


def _moving_frames(track: _Track) -> NDArray[np.intp]:
    """The frames in which the body moves most, in the order of time: the others tell nothing."""
    speed = _speeds(track)
    fastest = np.argsort(-np.nan_to_num(speed), kind="stable")[: 2 * MAX_FRAMES]
    return np.sort(fastest)[:: max(1, len(fastest) // MAX_FRAMES)]


def _speeds(track: _Track) -> FloatArray:
    """RMS speed of the tracked joints [m/s] about each frame, over a third of a second."""
    ahead, behind = 2 * SPEED_REACH, len(track.stamps) - 2 * SPEED_REACH
    squares = ((track.positions[ahead:] - track.positions[:behind]) ** 2).sum(axis=2)
    step = track.stamps[ahead:] - track.stamps[:behind]
    known = np.isfinite(squares)
    mean = np.where(known, squares, 0.0).sum(axis=1) / np.maximum(known.sum(axis=1), 1)
    speed = np.where(step <= ahead * MAX_GAP_S, np.sqrt(mean) / step, 0.0)
    return np.concatenate([np.zeros(SPEED_REACH), speed, np.zeros(SPEED_REACH)])


def _median_residual(a: _Track, b: _Track, compared: NDArray[np.intp], shift: float) -> float:
    """Median distance [m] of a joint in the two views under a shift."""
    target = a.positions[compared]
    source = b.at(a.stamps[compared] + shift)
    known = np.asarray(np.isfinite(source + target).all(axis=2))
    if np.count_nonzero(known.any(axis=1)) < MIN_FRAMES:
        return UNKNOWN_M
    try:
        fit = estimate_rigid_transform_robustly(source[known], target[known])
    except CalibrationError:
        return UNKNOWN_M
    return float(np.median(fit.residuals))


def _stddev(track: _Track, compared: NDArray[np.intp], residual: float) -> float:
    """Standard deviation [s] of a shift that moves joints by their speed against their error."""
    speed = _speeds(track)[compared]
    periods = np.unique(np.floor(track.stamps[compared] / CORRELATION_S))
    observations = len(periods) * len(JOINTS)
    mean_square = float(np.mean(speed**2)) / 3.0  # along the one direction of motion
    information = observations * mean_square
    if information == 0.0:
        return np.inf
    return max(residual, JOINT_ERROR_M) / float(np.sqrt(information))
