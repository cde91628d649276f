"""Detection of repeated movements in the angles, and their average.

A cycle is the interval between successive peaks of an angle. For each side, the angle with the most
cycles of similar duration and shape is used, leg angles preferred. This detects walking, marching,
squats and arm raises.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.signal import find_peaks

from pose_core.api import ANGLES, AngleSeries, FloatArray, IntArray
from pose_core.joints import SIDES
from pose_evaluation.range_of_motion import RATE, smoothed

MIN_SWING = 10.0  # [deg] smallest range of an angle with cycles
MIN_PROMINENCE = 0.4  # [-] smallest prominence of a peak, relative to the range
MIN_DURATION_S, MAX_DURATION_S = 0.4, 6.0  # [s] duration of a cycle
LIKE_LENGTH = 0.3  # [-] largest relative difference of a duration from the median
LIKE_COURSE = 0.8  # [-] smallest correlation of a cycle with the median of all
MIN_CYCLES = 3
PERCENT = np.linspace(0.0, 100.0, 101)  # [%] of the cycle
LEGS_FIRST = 1.5  # [-] ratio of cycles above which an arm's angle is preferred to a leg's


@dataclass(frozen=True, kw_only=True)
class Cycles:
    """The cycles of one side."""

    side: str
    angle: str  # whose peaks are the cycles' boundaries
    begin_ns: IntArray  # (k,) [ns]
    end_ns: IntArray  # (k,) [ns]

    @property
    def durations_s(self) -> FloatArray:
        """Duration of each cycle [s], shape (k,)."""
        return np.asarray((self.end_ns - self.begin_ns) * 1e-9, float)


@dataclass(frozen=True, kw_only=True)
class CycleCurve:
    """One angle over the cycle, over all cycles."""

    mean_deg: FloatArray  # (101,) [deg] at 0 to 100 % of the cycle
    sd_deg: FloatArray  # (101,) [deg] between cycles
    range_mean_deg: float  # [deg] range of motion of a cycle
    range_sd_deg: float  # [deg]
    cycles: int  # [-] cycles in which the angle is known throughout


def find_cycles(series: AngleSeries) -> dict[str, Cycles]:
    """The cycles by side; sides without cycles are left out."""
    stamps_ns, smooth = smoothed(series)
    found = {}
    for side in SIDES:
        best, best_score = None, 0.0
        for angle in (name for name in ANGLES if name.startswith(side)):
            peaks = _regular(np.degrees(smooth[angle]))
            leg = "hip" in angle or "knee" in angle
            score = len(peaks) * (LEGS_FIRST if leg else 1.0) * _swing(smooth[angle])
            if score > best_score:
                best, best_score = (angle, peaks), score
        if best is not None:
            pairs = np.array(best[1])
            found[side] = Cycles(
                side=side,
                angle=best[0],
                begin_ns=stamps_ns[pairs[:, 0]],
                end_ns=stamps_ns[pairs[:, 1]],
            )
    return found


def cycle_curves(series: AngleSeries, cycles: Cycles) -> dict[str, CycleCurve]:
    """Mean and standard deviation of the side's angles over its cycles.

    Angles that are known throughout fewer than three cycles are left out.
    """
    _, smooth = smoothed(series)
    begin_ns = int(series.stamps_ns[0]) if len(series) else 0
    curves = {}
    for angle in (name for name in ANGLES if name.startswith(cycles.side)):
        starts = (cycles.begin_ns - begin_ns) * 1e-9 * RATE
        ends = (cycles.end_ns - begin_ns) * 1e-9 * RATE
        courses = np.array(
            [_course(smooth[angle], *limits) for limits in zip(starts, ends, strict=True)]
        )
        courses = np.degrees(courses[np.isfinite(courses).all(axis=1)])
        if len(courses) >= MIN_CYCLES:
            ranges = np.ptp(courses, axis=1)
            curves[angle] = CycleCurve(
                mean_deg=courses.mean(axis=0),
                sd_deg=courses.std(axis=0, ddof=1),
                range_mean_deg=float(ranges.mean()),
                range_sd_deg=float(ranges.std(ddof=1)),
                cycles=len(courses),
            )
    return curves


def _regular(degrees: FloatArray) -> list[tuple[int, int]]:
    """Pairs of successive peaks, as indices, that bound similar cycles."""
    swing = _swing(degrees)
    if swing < MIN_SWING:
        return []
    filled = np.where(np.isfinite(degrees), degrees, np.nanmin(degrees))
    prominence = max(0.5 * MIN_SWING, MIN_PROMINENCE * swing)
    peaks, _ = find_peaks(filled, prominence=prominence, distance=round(MIN_DURATION_S * RATE))
    pairs = [
        (int(a), int(b))
        for a, b in pairwise(peaks)
        if b - a <= MAX_DURATION_S * RATE and np.isfinite(degrees[a : b + 1]).all()
    ]
    return _of_like_course(degrees, _of_like_length(pairs))


def _of_like_length(pairs: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """The largest set of cycles whose durations are within 30 % of a common value."""
    lengths = np.array([b - a for a, b in pairs], float)
    best: list[tuple[int, int]] = []
    for middle in lengths:
        near = np.abs(lengths - middle) <= LIKE_LENGTH * middle
        if near.sum() > len(best):
            best = [pair for pair, is_near in zip(pairs, near, strict=True) if is_near]
    return best if len(best) >= MIN_CYCLES else []


def _of_like_course(degrees: FloatArray, pairs: list[tuple[int, int]]) -> list[tuple[int, int]]:
    if not pairs:
        return []
    courses = np.array([_course(degrees, a, b) for a, b in pairs])
    typical = np.median(courses, axis=0)
    if typical.std() == 0.0:
        return []
    alike = [
        pair
        for pair, course in zip(pairs, courses, strict=True)
        if course.std() > 0.0 and np.corrcoef(course, typical)[0, 1] >= LIKE_COURSE
    ]
    # Isolated cycles, not directly before or after another one, are left out.
    begins, ends = {begin for begin, _ in alike}, {end for _, end in alike}
    kept = [(begin, end) for begin, end in alike if begin in ends or end in begins]
    return kept if len(kept) >= MIN_CYCLES else []


def _course(values: FloatArray, begin: float, end: float) -> FloatArray:
    """Values at 0 to 100 % between two positions on the grid; NaN outside."""
    places = begin + PERCENT / 100.0 * (end - begin)
    grid = np.arange(len(values), dtype=float)
    return np.interp(places, grid, values, left=np.nan, right=np.nan)


def _swing(values: FloatArray) -> float:
    known = values[np.isfinite(values)]
    return float(np.ptp(np.percentile(known, [5, 95]))) if len(known) else 0.0
