"""Time alignment of a reference with a recording by cross-correlation of the angles.

The result is the shift with the highest pooled correlation of all angles, among all shifts with an
overlap of at least half of the shorter recording.
"""

from dataclasses import dataclass

import numpy as np

from pose_core.api import AngleSeries, FloatArray, angle_columns, without_sideways_flexion
from pose_core.errors import InputError
from pose_evaluation.time_shift import estimate_angle_shift, moving, pooled_correlations
from pose_io.references.reference import Reference

COARSE_RATE = 25.0  # [Hz] of the search; refined afterwards
MIN_OVERLAP_S = 1.0  # [s]
MIN_SHARE = 0.5  # [-] smallest overlap, relative to the shorter recording
APART_S = 0.5  # [s] smallest distance of the next best shift from the best
WEAK = 0.5  # [-] smallest accepted correlation
DOUBTFUL = 0.7  # [-] correlation below which another instant must not fit nearly as well
DOUBTFUL_LEAD = 0.05  # [-]


@dataclass(frozen=True, kw_only=True)
class ReferenceAlignment:
    """Result of aligning a reference with the recording's clock."""

    begins_at_s: float  # [s] start of the reference after the recording's first instant
    shares_clock: bool  # whether both already have the same clock
    correlation: float  # [-] of all angles together at this shift; NaN if the clock is shared
    next_best: float  # [-] the highest one at least 0.5 s away; NaN if there is none

    @property
    def is_doubtful(self) -> bool:
        """Whether the reference fits only weakly, and elsewhere nearly as well."""
        is_weak = not self.shares_clock and self.correlation < DOUBTFUL
        return is_weak and self.next_best > self.correlation - DOUBTFUL_LEAD


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
    if len(known) < 2 or len(recording) < 2:
        raise InputError(
            f"{reference.name} has {len(known)} frames, the recording {len(recording)}: too few "
            "to align"
        )
    overlap_ns = min(known.stamps_ns[-1], recording.stamps_ns[-1]) - max(
        known.stamps_ns[0], recording.stamps_ns[0]
    )
    if overlap_ns >= MIN_OVERLAP_S * 1e9:
        return reference, ReferenceAlignment(
            begins_at_s=_seconds(known, recording),
            shares_clock=True,
            correlation=np.nan,
            next_best=np.nan,
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
    moves = moving(expected)
    lags, scores = pooled_correlations(expected[:, moves], found[:, moves])
    overlap = np.minimum(len(expected), len(found) - lags) - np.maximum(0, -lags)
    shorter = min(len(expected), len(found))
    enough = overlap >= max(MIN_OVERLAP_S * COARSE_RATE, MIN_SHARE * shorter)
    return lags / COARSE_RATE, np.where(enough, scores, np.nan)


def _on_grid(series: AngleSeries, *, sideways: bool) -> FloatArray:
    step_ns = round(1e9 / COARSE_RATE)
    stamps_ns = np.arange(series.stamps_ns[0], series.stamps_ns[-1] + 1, step_ns, dtype=np.int64)
    angles = series.at(stamps_ns)
    return angle_columns(angles if sideways else without_sideways_flexion(angles))
