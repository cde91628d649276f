r"""A clock's offset and drift from offsets that were measured now and then.

With :math:`o_k` measured at :math:`s_k`, the line :math:`o + d\,(s - s_0)` is fitted by weighted
least squares, where what quartzes usually do, a drift of :math:`0 \pm 50` ppm, counts as one more
measurement: a minute tells no drift, an hour does. Older measurements count less, since a drift
changes with the temperature.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pose_core.session.clocks import Clock
from pose_core.stamps import NS_PER_S

DRIFT_STDDEV = 5e-5  # [-] of quartzes that nobody disciplines
FORGET_S = 1200.0  # [s] after which a measurement counts for 1/e
HUBER = 2.0  # [-] standard deviations
ITERATIONS = 10


@dataclass(frozen=True, kw_only=True)
class Measured:
    """An offset that was measured in one stretch of motion."""

    at_s: float  # [s] by the source's own clock
    offset_s: float  # [s] how far it was ahead
    noise_s: float  # [s] standard deviation between one stretch and the next
    stddev_s: float  # [s] altogether, with what no further stretch averages out


def clock_from(measured: Sequence[Measured], begin_ns: int, systematic_s: float) -> Clock:
    """The clock that explains the measurements.

    Args:
        measured: One or more.
        begin_ns: What their stamps are counted from [ns].
        systematic_s: A deviation [s] that all measurements share, if each states less.
    """
    at = np.array([one.at_s for one in measured])
    offset = np.array([one.offset_s for one in measured])
    zero = float(np.average(at, weights=np.exp((at - at.max()) / FORGET_S)))
    weight = np.exp((at - at.max()) / FORGET_S)
    weight /= np.array([one.noise_s for one in measured]) ** 2
    design = np.column_stack([np.ones(len(at)), at - zero])
    prior = np.diag([0.0, DRIFT_STDDEV**-2])
    solution = np.array([np.median(offset), 0.0])
    for _ in range(ITERATIONS):
        off = np.abs(offset - design @ solution) * np.sqrt(weight)
        robust = weight * np.minimum(1.0, HUBER / np.maximum(off, 1e-9))
        covariance = np.linalg.inv(design.T @ (design * robust[:, None]) + prior)
        solution = covariance @ (design.T @ (robust * offset))
    shared = min(systematic_s, min(one.stddev_s for one in measured))
    return Clock(
        offset_ns=round(float(solution[0]) * NS_PER_S),
        drift=float(solution[1]),
        at_ns=begin_ns + round(zero * NS_PER_S),
        stddev_s=float(np.hypot(np.sqrt(covariance[0, 0]), shared)),
        drift_stddev=float(np.sqrt(covariance[1, 1])),
    )
