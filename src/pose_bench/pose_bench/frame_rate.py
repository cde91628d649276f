"""How fast a recording without stamps really ran, found by what another system saw meanwhile.

A Kinect that cannot keep up leaves frames out; a file of frames without their times then looks
shorter than it was. One rate a file, found with the raw view and given to every method, takes out
the most of it.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pose_core.body.joint_angles import wrapped
from pose_core.streams.angle_series import AngleSeries
from pose_core.streams.samples import FloatArray

STRETCHES = np.arange(0.9, 1.301, 0.02)  # [-] true time over nominal time
SHIFTS_S = np.arange(-0.4, 0.401, 0.04)  # [s]
Pair = tuple[FloatArray, NDArray[np.complex128], FloatArray]
"""Nominal times [s] of a view's angle, the angle on the unit circle, and the true angle [rad]."""
LEAST_COMMON = 0.8  # [-] share of the other system's instants that must be seen


def time_stretch(view: AngleSeries, other: AngleSeries, angles: Sequence[str]) -> float:
    """True time over nominal time of a view; 1 if nothing fits better.

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
            if seen.mean() < LEAST_COMMON:
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
