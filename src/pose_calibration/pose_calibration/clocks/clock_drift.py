r"""A clock's offset and drift from offsets measured at several times.

With :math:`o_k` measured at :math:`s_k`, the line :math:`o + d\,(s - s_0)` is fitted by weighted
least squares, with the usual drift of quartzes, :math:`0 \pm 50` ppm, as prior: a drift is
observable over an hour, not over a minute. Older measurements have smaller weights, since the drift
changes with temperature.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pose_core.api import Clock
from pose_core.stamps import NS_PER_S

DRIFT_STDDEV = 5e-5  # [-] of quartzes without synchronisation
FORGET_S = 1200.0  # [s] after which a measurement's weight is 1/e
HUBER = 2.0  # [-] standard deviations
ITERATIONS = 10


@dataclass(frozen=True, kw_only=True)
class MeasuredOffset:
    """An offset measured in one window of motion."""

    at_s: float  # [s] by the source's own clock
    offset_s: float  # [s] by which the clock was ahead
    noise_s: float  # [s] standard deviation between windows
    stddev_s: float  # [s] total, including errors common to all windows


def measure_outwards(
    starts: NDArray[np.floating],
    middle: float,
    known: float,
    measure: Callable[[float, float], MeasuredOffset | None],
) -> list[MeasuredOffset]:
    """Offsets in windows, each searched near the one before it: an offset drifts.

    Args:
        starts: Starts of the windows, ascending [s].
        middle: The start from which on the known offset is followed; the earlier ones backwards.
        known: The offset there [s].
        measure: Measures the offset in the window that starts at the first argument [s], near the
            second [s]; None if the motion is too small.
    """
    measured = []
    for direction in (starts[starts >= middle], starts[starts < middle][::-1]):
        near = known
        for start in direction:
            one = measure(float(start), near)
            if one is not None:
                measured.append(one)
                near = one.offset_s
    return sorted(measured, key=lambda one: one.at_s)


def clock_from(measured: Sequence[MeasuredOffset], begin_ns: int, systematic_s: float) -> Clock:
    """Fit a clock to measurements.

    Args:
        measured: One or more measurements.
        begin_ns: Time zero of their stamps [ns].
        systematic_s: Standard deviation [s] of the error common to all measurements, used where
            larger than their own.
    """
    at = np.array([each.at_s for each in measured])
    offset = np.array([each.offset_s for each in measured])
    recent = np.exp((at - at.max()) / FORGET_S)
    zero = float(np.average(at, weights=recent))
    weight = recent / np.array([each.noise_s for each in measured]) ** 2
    design = np.column_stack([np.ones(len(at)), at - zero])
    prior = np.diag([0.0, DRIFT_STDDEV**-2])
    solution = np.array([np.median(offset), 0.0])
    for _ in range(ITERATIONS):
        off = np.abs(offset - design @ solution) * np.sqrt(weight)
        robust = weight * np.minimum(1.0, HUBER / np.maximum(off, 1e-9))
        covariance = np.linalg.inv(design.T @ (design * robust[:, None]) + prior)
        solution = covariance @ (design.T @ (robust * offset))
    shared = min(systematic_s, min(each.stddev_s for each in measured))
    return Clock(
        offset_ns=round(float(solution[0]) * NS_PER_S),
        drift=float(solution[1]),
        at_ns=begin_ns + round(zero * NS_PER_S),
        stddev_s=float(np.hypot(np.sqrt(covariance[0, 0]), shared)),
        drift_stddev=float(np.sqrt(covariance[1, 1])),
    )
