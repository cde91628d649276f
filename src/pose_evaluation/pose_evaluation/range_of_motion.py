"""Range of motion, peaks and left/right symmetry of the angles.

All are computed after a zero-phase low-pass filter (Butterworth, 4th order forward and back,
6 Hz: Winter, Biomechanics and Motor Control of Human Movement), which removes peaks of noise.
Flexion of hip and shoulder is undefined, and left out, where the limb points sideways.
"""

from dataclasses import dataclass

import numpy as np
from scipy.signal import butter, sosfiltfilt

from pose_core.api import (
    ANGLES,
    AngleSeries,
    FloatArray,
    IntArray,
    anatomical,
    without_sideways_flexion,
)

RATE = 100.0  # [Hz]
CUTOFF = 6.0  # [Hz]
MAX_GAP_S = 0.5  # [s] longest gap that is interpolated
SMALL = 5.0  # [deg] smallest range with a symmetry index


@dataclass(frozen=True, kw_only=True)
class AngleRange:
    """Extremes of one angle; NaN if it was never known."""

    lowest_deg: float  # [deg]
    lowest_s: float  # [s] since the first instant
    highest_deg: float  # [deg]
    highest_s: float  # [s] since the first instant

    @property
    def range_deg(self) -> float:
        """Range of motion [deg]."""
        return self.highest_deg - self.lowest_deg


def ranges_of_motion(series: AngleSeries, begin_ns: int) -> dict[str, AngleRange]:
    """Extremes of each angle, timed [s] from ``begin_ns``."""
    stamps_ns, smooth = smoothed(series)
    times_s = np.asarray((stamps_ns - begin_ns) * 1e-9, float)
    return {name: _range(np.degrees(smooth[name]), times_s) for name in ANGLES}


def symmetry_index_percent(left: float, right: float) -> float:
    """(left − right) over their mean [%]: Robinson et al. (1987), J Manip Physiol Ther 10:172.

    0 is symmetric; positive if the left is larger. NaN if both are below 5 deg.
    """
    mean = 0.5 * (abs(left) + abs(right))
    return 100.0 * (left - right) / mean if mean > SMALL else np.nan


def smoothed(series: AngleSeries) -> tuple[IntArray, dict[str, FloatArray]]:
    """The angles at 100 Hz after the low-pass filter.

    Returns:
        Instants (n,) [ns] and angles (n,) [rad] by name; NaN at gaps of more than 0.5 s,
        and flexion where the limb points sideways.
    """
    if len(series) == 0:
        return np.zeros(0, np.int64), {name: np.zeros(0) for name in ANGLES}
    step_ns = round(1e9 / RATE)
    stamps_ns = np.arange(series.stamps_ns[0], series.stamps_ns[-1] + 1, step_ns, dtype=np.int64)
    angles = without_sideways_flexion(series.at(stamps_ns, MAX_GAP_S))
    return stamps_ns, {name: anatomical(_low_pass(values)) for name, values in angles.items()}


def _low_pass(values: FloatArray) -> FloatArray:
    """Filter each run without NaN, unwrapped; runs too short for the filter are unchanged."""
    sections = butter(2, CUTOFF, fs=RATE, output="sos")  # twice over: 4th order
    result = values.copy()
    known = np.flatnonzero(np.isfinite(values))
    for stretch in np.split(known, np.flatnonzero(np.diff(known) > 1) + 1):
        if len(stretch) > round(RATE / CUTOFF):
            padding = min(len(stretch) - 1, round(RATE / 2))
            course = np.unwrap(values[stretch])
            result[stretch] = sosfiltfilt(sections, course, padtype="even", padlen=padding)
    return result


def _range(degrees: FloatArray, times_s: FloatArray) -> AngleRange:
    if not np.isfinite(degrees).any():
        return AngleRange(lowest_deg=np.nan, lowest_s=np.nan, highest_deg=np.nan, highest_s=np.nan)
    low, high = int(np.nanargmin(degrees)), int(np.nanargmax(degrees))
    return AngleRange(
        lowest_deg=float(degrees[low]),
        lowest_s=float(times_s[low]),
        highest_deg=float(degrees[high]),
        highest_s=float(times_s[high]),
    )
