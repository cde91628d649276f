"""One time shift between two recordings of the same motion, by cross-correlating joint angles."""

from collections.abc import Iterator

import numpy as np
from scipy.signal import correlate

from pose_core.api import (
    AngleSeries,
    FloatArray,
    SkeletonSeries,
    angle_columns,
    angle_series,
    without_sideways_flexion,
)
from pose_io.arrays import BoolArray, IntArray

GRID_RATE = 100.0  # [Hz]
MAX_SHIFT_S = 0.5  # [s]
STILL = np.radians(1.0)  # [rad] standard deviation below which an angle counts as constant


def estimate_time_shift(method: SkeletonSeries, reference: SkeletonSeries) -> float:
    """Estimate the delay of a recording relative to a reference of the same motion.

    The shift at which the correlation of all angles together is highest, refined below the grid's
    10 ms by a parabola through the peak.

    Args:
        method: The recording, in any frame.
        reference: The reference, in any frame.

    Returns:
        The shift [s]: ``method.shifted(-shift)`` fits the reference. 0 if the two do not
        overlap, or the reference does not move.
    """
    return estimate_angle_shift(angle_series(method), angle_series(reference))


def estimate_angle_shift(
    method: AngleSeries, reference: AngleSeries, max_shift_s: float = MAX_SHIFT_S
) -> float:
    """Delay of a recording's angles relative to a reference's, as :func:`estimate_time_shift`."""
    if len(method) == 0 or len(reference) == 0:
        return 0.0
    step_ns = round(1e9 / GRID_RATE)
    begin = max(reference.stamps_ns[0], method.stamps_ns[0])
    end = min(reference.stamps_ns[-1], method.stamps_ns[-1])
    stamps_ns = np.arange(begin, end + 1, step_ns, dtype=np.int64)
    most = round(max_shift_s * GRID_RATE)
    if len(stamps_ns) <= 4 * most:
        most = len(stamps_ns) // 4
    if most < 2:
        return 0.0
    expected = angle_columns(without_sideways_flexion(reference.at(stamps_ns)))
    found = angle_columns(method.at(stamps_ns))
    if not moving(expected).any():
        return 0.0
    lags, scores = pooled_correlations(expected, found)
    near = np.abs(lags) <= most
    lags, scores = lags[near], scores[near]
    if not np.isfinite(scores).any():
        return 0.0
    # A constant ramp fits equally at every lag: of equal ones the smallest is used.
    best = int(np.nanargmax(scores - 1e-6 * np.abs(lags) / most))
    return float(lags[best] + _peak_offset(scores, best)) / GRID_RATE


def moving(angles: FloatArray) -> BoolArray:
    """Which angles [rad], shape (n, d), vary by more than :data:`STILL`; unknown ones do not."""
    known = np.flatnonzero(np.isfinite(angles).any(axis=0))
    result = np.zeros(angles.shape[1], bool)
    result[known] = np.nanstd(angles[:, known], axis=0) > STILL
    return result


def pooled_correlations(expected: FloatArray, found: FloatArray) -> tuple[IntArray, FloatArray]:
    """Correlation of all angles together at every lag.

    Args:
        expected: Angles [rad] on a regular grid, shape (n, d), NaN where unknown.
        found: The same angles of another recording, on the same grid, shape (m, d).

    Returns:
        The lags of ``found`` behind ``expected`` [samples], −(n − 1) to m − 1; and the correlation
        at each, NaN where the known samples in common hardly move.
    """
    lags = np.arange(-(len(expected) - 1), len(found))
    covariance, first, second = np.zeros((3, len(lags)))
    for x, y in zip(expected.T, found.T, strict=True):
        count, sum_x, sum_y, sum_xx, sum_yy, sum_xy = _sums(x, y)
        count = np.maximum(np.round(count), 1.0)
        covariance += sum_xy - sum_x * sum_y / count
        first += np.maximum(sum_xx - sum_x**2 / count, 0.0)
        second += np.maximum(sum_yy - sum_y**2 / count, 0.0)
    power = np.sqrt(first * second)
    moves = power > STILL**2
    return lags, np.where(moves, covariance / np.where(moves, power, 1.0), np.nan)


def _sums(x: FloatArray, y: FloatArray) -> Iterator[FloatArray]:
    """Counts and sums of x, y, x², y², xy over the common known samples of two series, by shift."""
    known_x, known_y = np.isfinite(x).astype(float), np.isfinite(y).astype(float)
    x = np.where(known_x > 0.0, x - np.nanmean(x), 0.0) if known_x.any() else 0.0 * known_x
    y = np.where(known_y > 0.0, y - np.nanmean(y), 0.0) if known_y.any() else 0.0 * known_y

    for of_x, of_y in (
        (known_x, known_y),
        (x, known_y),
        (known_x, y),
        (x**2, known_y),
        (known_x, y**2),
        (x, y),
    ):
        yield correlate(of_y, of_x, mode="full", method="fft")


def _peak_offset(scores: FloatArray, best: int) -> float:
    """Position of the peak between the samples, by a parabola, −0.5 to 0.5 [samples]."""
    if not 0 < best < len(scores) - 1:
        return 0.0
    before, peak, after = scores[best - 1 : best + 2]
    curvature = before - 2.0 * peak + after
    if not np.isfinite(curvature) or curvature >= 0.0:
        return 0.0
    return float(np.clip(0.5 * (before - after) / curvature, -0.5, 0.5))
