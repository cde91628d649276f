"""Estimation of the true frame rate of a recording without stamps, with a second system.

An overloaded Kinect skips frames; a file of frames without times then seems too short. One rate per
file, estimated with the raw view and used for every method, corrects most of it.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pose_core.api import AngleSeries, wrapped
from pose_core.arrays import FloatArray

STRETCHES = np.arange(0.9, 1.301, 0.02)  # [-] true time over nominal time
SHIFTS_S = np.arange(-0.4, 0.401, 0.04)  # [s]
Pair = tuple[FloatArray, NDArray[np.complex128], FloatArray]
"""Nominal times [s] of a view's angle, the angle on the unit circle, and the true angle [rad]."""
MIN_COMMON = 0.8  # [-] required share of the other system's instants


def time_stretch(view: AngleSeries, other: AngleSeries, angles: Sequence[str]) -> float:
    """Ratio of true to nominal time of a view; 1 if no other fits better.

    Args:
        view: Angles by nominal stamps.
        other: The same motion with true stamps.
        angles: The angles that move.
    """
    times = 1e-9 * view.stamps_ns
    true_times = 1e-9 * other.stamps_ns
    pairs: list[Pair] = []
    for angle in angles:
        known = np.isfinite(view.angles[angle])
        if known.sum() > 1:
            turned = np.exp(1j * view.angles[angle][known])
            pairs.append((np.asarray(times[known], np.float64), turned, other.angles[angle]))
    best, least = 1.0, np.inf
    for stretch in STRETCHES[np.argsort(np.abs(STRETCHES - 1.0))]:
        for shift_s in SHIFTS_S:
            instants = (true_times - shift_s) / stretch
            seen = (instants >= times[0]) & (instants <= times[-1])
            if seen.mean() < MIN_COMMON:
                continue
            error = _spread(pairs, instants, seen)
            if error < least:
                best, least = float(stretch), error
    return best


def _spread(pairs: Sequence[Pair], instants: FloatArray, seen: FloatArray) -> float:
    """Mean over angles of the errors' standard deviation [rad]."""
    spreads = []
    for times, turned, true in pairs:
        error = np.angle(np.interp(instants[seen], times, turned)) - true[seen]
        error = error[np.isfinite(error)]
        if len(error):
            mean = np.angle(np.mean(np.exp(1j * error)))
            spreads.append(float(np.sqrt(np.mean(wrapped(error - mean) ** 2))))
    return float(np.mean(spreads)) if spreads else np.inf
