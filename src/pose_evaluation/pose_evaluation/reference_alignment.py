"""Time alignment of a reference with a recording by cross-correlation of the angles.

The result is the shift with the highest pooled correlation of all angles, among all shifts with an
overlap of at least half of the shorter recording.
"""

from dataclasses import dataclass

import numpy as np
from scipy.signal import correlate

from pose_core.api import AngleSeries, FloatArray, angle_columns, without_sideways_flexion
from pose_core.errors import InputError
from pose_evaluation.time_shift import STILL, estimate_angle_shift
from pose_io.references.reference import Reference

COARSE_RATE = 25.0  # [Hz] of the search; refined afterwards
LEAST_OVERLAP_S = 1.0  # [s]
LEAST_SHARE = 0.5  # [-] smallest overlap, relative to the shorter recording
APART_S = 0.5  # [s] smallest distance of the next best shift from the best
WEAK = 0.5  # [-] smallest accepted correlation


@dataclass(frozen=True, kw_only=True)
class ReferenceAlignment:
    """Result of aligning a reference with the recording's clock."""

    begins_at_s: float  # [s] start of the reference after the recording's first instant
    shares_clock: bool  # whether both already have the same clock
    correlation: float  # [-] of all angles together at this shift; NaN if the clock is shared
    next_best: float  # [-] the highest one at least 0.5 s away; NaN if there is none


def align_reference(
    reference: Reference, recording: AngleSeries
) -> tuple[Reference, ReferenceAlignment]:
    """Align a reference with a recording's clock, unless they share one.

    Args:
        reference: The reference.
        recording: Angles of a method of the recording.

    Returns:
        The reference with shifted stamps, and the alignment.

    Raises:
        InputError: If there is no motion, or no shift has a sufficient correlation.
    """
    known = reference.angles
    if _overlap_s(known, recording) >= LEAST_OVERLAP_S:
        return reference, ReferenceAlignment(
            begins_at_s=_seconds(known, recording),
            shares_clock=True,
            correlation=np.nan,
            next_best=np.nan,
        )
    if len(known) < 2 or len(recording) < 2:
        raise InputError(
            f"{reference.name} has {len(known)} frames, the recording {len(recording)}: too few "
            "to align"
        )
    start_ns = int(recording.stamps_ns[0]) - int(known.stamps_ns[0])
    lags_s, scores = _correlations(known, recording)
    best = _best(reference.name, scores)
    coarse_ns = start_ns + round(1e9 * float(lags_s[best]))
    fine_s = estimate_angle_shift(recording, known.shifted(coarse_ns), 4.0 / COARSE_RATE)
    shift_ns = coarse_ns + round(1e9 * fine_s)
    moved = reference.shifted(shift_ns)
    others = scores[np.abs(lags_s - lags_s[best]) > APART_S]
    alignment = ReferenceAlignment(
        begins_at_s=_seconds(moved.angles, recording),
        shares_clock=False,
        correlation=float(scores[best]),
        next_best=float(np.nanmax(others)) if np.isfinite(others).any() else np.nan,
    )
    return moved, alignment


def _seconds(reference: AngleSeries, recording: AngleSeries) -> float:
    return (int(reference.stamps_ns[0]) - int(recording.stamps_ns[0])) * 1e-9


def _overlap_s(first: AngleSeries, second: AngleSeries) -> float:
    if len(first) == 0 or len(second) == 0:
        return 0.0
    begin = max(int(first.stamps_ns[0]), int(second.stamps_ns[0]))
    end = min(int(first.stamps_ns[-1]), int(second.stamps_ns[-1]))
    return (end - begin) * 1e-9


def _best(name: str, scores: FloatArray) -> int:
    if not np.isfinite(scores).any():
        raise InputError(
            f"{name} cannot be aligned in time: it, or the recording, does not move or is too short"
        )
    best = int(np.nanargmax(scores))
    if scores[best] < WEAK:
        raise InputError(
            f"{name} shows another motion than the recording: their angles correlate by "
            f"{scores[best]:.2f} at best, expected more than {WEAK:g}"
        )
    return best


def _correlations(reference: AngleSeries, recording: AngleSeries) -> tuple[FloatArray, FloatArray]:
    """Pooled correlation by shift.

    Returns:
        Shifts [s] of the reference relative to a common start, and the correlation of all angles at
        each, NaN where the overlap is too short.
    """
    expected, found = _on_grid(reference, sideways=False), _on_grid(recording, sideways=True)
    moves = np.nanstd(np.where(np.isfinite(expected), expected, np.nan), axis=0) > STILL
    expected, found = expected[:, moves], found[:, moves]
    lags = np.arange(-(len(expected) - 1), len(found))
    covariance, first, second = np.zeros((3, len(lags)))
    for x, y in zip(expected.T, found.T, strict=True):
        count, products = _sums(x, y)
        sum_x, sum_y, sum_xx, sum_yy, sum_xy = products
        count = np.maximum(count, 1.0)
        covariance += sum_xy - sum_x * sum_y / count
        first += np.maximum(sum_xx - sum_x**2 / count, 0.0)
        second += np.maximum(sum_yy - sum_y**2 / count, 0.0)
    overlap = np.minimum(len(expected), len(found) - lags) - np.maximum(0, -lags)
    shorter = min(len(expected), len(found))
    enough = overlap >= max(LEAST_OVERLAP_S * COARSE_RATE, LEAST_SHARE * shorter)
    power = np.sqrt(first * second)
    usable = enough & (power > STILL**2)
    scores = np.where(usable, covariance / np.where(usable, power, 1.0), np.nan)
    return lags / COARSE_RATE, scores


def _sums(x: FloatArray, y: FloatArray) -> tuple[FloatArray, tuple[FloatArray, ...]]:
    """Counts and sums over the common known samples of two series, by shift."""
    known_x, known_y = np.isfinite(x).astype(float), np.isfinite(y).astype(float)
    x = np.where(known_x > 0.0, x - np.nanmean(x), 0.0) if known_x.any() else 0.0 * known_x
    y = np.where(known_y > 0.0, y - np.nanmean(y), 0.0) if known_y.any() else 0.0 * known_y

    def by_shift(of_x: FloatArray, of_y: FloatArray) -> FloatArray:
        return np.asarray(correlate(of_y, of_x, mode="full", method="fft"))

    count = np.round(by_shift(known_x, known_y))
    sums = (
        by_shift(x, known_y),
        by_shift(known_x, y),
        by_shift(x**2, known_y),
        by_shift(known_x, y**2),
        by_shift(x, y),
    )
    return count, sums


def _on_grid(series: AngleSeries, *, sideways: bool) -> FloatArray:
    step_ns = round(1e9 / COARSE_RATE)
    stamps_ns = np.arange(series.stamps_ns[0], series.stamps_ns[-1] + 1, step_ns, dtype=np.int64)
    angles = series.at(stamps_ns)
    return angle_columns(angles if sideways else without_sideways_flexion(angles))
