"""One time shift between two recordings of the same motion, by cross-correlating joint angles."""

import numpy as np

from pose_core.api import (
    AngleSeries,
    FloatArray,
    SkeletonSeries,
    angle_columns,
    angle_series,
    without_sideways_flexion,
)

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
    with np.errstate(invalid="ignore"):
        moving = np.nanstd(expected, axis=0) > STILL if np.isfinite(expected).any() else []
    if not np.any(moving):
        return 0.0
    lags = np.arange(-most, most + 1)
    scores = np.array([_correlation(expected, found, int(lag)) for lag in lags])
    if not np.isfinite(scores).any():
        return 0.0
    # A constant ramp fits equally at every lag: of equal ones the smallest is used.
    best = int(np.nanargmax(scores - 1e-6 * np.abs(lags) / most))
    return float(lags[best] + _peak_offset(scores, best)) / GRID_RATE


def _correlation(expected: FloatArray, found: FloatArray, lag: int) -> float:
    """Pooled correlation of all angles with ``found`` taken ``lag`` samples later."""
    count = len(expected) - abs(lag)
    first = expected[max(0, -lag) :][:count]
    second = found[max(0, lag) :][:count]
    known = np.isfinite(first) & np.isfinite(second)
    counts = np.maximum(known.sum(axis=0), 1)
    first = np.where(known, first, 0.0)
    second = np.where(known, second, 0.0)
    first = np.where(known, first - first.sum(axis=0) / counts, 0.0)
    second = np.where(known, second - second.sum(axis=0) / counts, 0.0)
    power = np.sqrt(np.sum(first**2) * np.sum(second**2))
    return float(np.sum(first * second) / power) if power > 0.0 else np.nan


def _peak_offset(scores: FloatArray, best: int) -> float:
    """Position of the peak between the samples, by a parabola, −0.5 to 0.5 [samples]."""
    if not 0 < best < len(scores) - 1:
        return 0.0
    before, peak, after = scores[best - 1 : best + 2]
    curvature = before - 2.0 * peak + after
    if not np.isfinite(curvature) or curvature >= 0.0:
        return 0.0
    return float(np.clip(0.5 * (before - after) / curvature, -0.5, 0.5))
