r"""Detection of exchanged and inverted IMUs: fit of each IMU's motion to each segment's.

In the N-pose every segment is upright, so the sensor's axis that was vertical then,
:math:`u = R_{ws}(0)^T e_z`, is the long axis of the segment that carries it. It fits a segment
whose measured long axis is :math:`a(t)` if a heading :math:`y` of the sensor's world gives
:math:`a(t) = R_z(y)\,R_{ws}(t)\,u`. The residuals are summed in units of their variance,

.. math:: \chi^2 = \min_y \sum_t \frac{\Delta t}{T} \min(|a - R_z(y) R_{ws} u|^2 / \sigma^2, c^2)

so that differences between segments are twice their log-likelihood ratio.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pose_calibration.imus.alignment_fit import CORRELATION_S, LAG_S, axis_stddev
from pose_calibration.imus.observations import PERIOD_NS, ImuObservations
from pose_core.api import FloatArray

TURNS = np.radians(np.arange(0.0, 360.0, 3.0))
CAP = 4.0  # [-] standard deviations at which a residual is capped: trackers lose joints
CLEARLY = 15.0  # [-] of chi-square, by which another assignment must be better
SHARE = 1.0 / CORRELATION_S * PERIOD_NS * 1e-9  # [-] independent measurements per instant
LEAST_INSTANTS = 30  # [-] measured by both
MIRRORED = np.array([-1.0, 1.0, 1.0])  # effect of a world whose z points down on u


@dataclass(frozen=True, kw_only=True)
class Explanations:
    """What the motion tells of the sensors' segments."""

    swapped: list[tuple[str, str]]  # segments whose sensors fit each other's clearly better
    upside_down: list[str]  # segments whose sensor fits clearly better with its world inverted
    alike: list[tuple[str, str]]  # segments whose motions are too similar to detect an exchange


def explain(observations: ImuObservations) -> Explanations:
    """Compare every sensor with every segment that carries one."""
    o, count = observations, len(observations.segments)
    chi_square, upside_down = np.full((count, count), np.nan), np.full(count, np.nan)
    for i in range(count):
        axis = _upright_axis(o, i)
        for j in range(count):
            chi_square[i, j] = _unexplained(o, axis, i, j)
        upside_down[i] = _unexplained(o, axis * MIRRORED, i, i)
    own = np.diag(chi_square)
    gain = own[:, None] + own - chi_square - chi_square.T  # of an exchange

    def pairs(chosen: NDArray[np.bool_]) -> list[tuple[str, str]]:
        found = np.argwhere(np.triu(chosen, 1)).tolist()
        return [(o.segments[i], o.segments[j]) for i, j in found]

    return Explanations(
        swapped=pairs(gain > CLEARLY),
        upside_down=[o.segments[i] for i in np.flatnonzero(own - upside_down > CLEARLY)],
        alike=pairs(~(np.abs(gain) > CLEARLY)),
    )


def _upright_axis(o: ImuObservations, i: int) -> FloatArray:
    """A sensor's axis that was vertical in the N-pose, in its world, shape (n, 3)."""
    standing = o.R_world_sensor[o.is_neutral, i, 2]
    known = standing[np.isfinite(standing[:, 0])]
    if len(known) == 0:
        return np.full((len(o.times_s), 3), np.nan)
    u = known.mean(axis=0)
    return np.asarray(o.R_world_sensor[:, i] @ (u / np.linalg.norm(u)))


def _unexplained(o: ImuObservations, axis: FloatArray, sensor: int, segment: int) -> float:
    """Chi-square of a sensor's axis on a segment's; NaN with too few instants."""
    segment_axis = o.long_axis[:, segment]
    known = np.isfinite(axis[:, 0]) & np.isfinite(segment_axis[:, 0])
    if np.count_nonzero(known) < LEAST_INSTANTS:
        return math.nan
    p, a = axis[known], segment_axis[known]
    variance = axis_stddev(o.segments[segment]) ** 2 + (LAG_S * o.rate[known, sensor]) ** 2
    # |a - R_z(y) p|^2 = 2 - 2 (upright + along cos y + across sin y), of unit vectors
    upright = a[:, 2] * p[:, 2]
    along = a[:, 0] * p[:, 0] + a[:, 1] * p[:, 1]
    across = a[:, 1] * p[:, 0] - a[:, 0] * p[:, 1]
    cosine = upright + np.outer(np.cos(TURNS), along) + np.outer(np.sin(TURNS), across)
    left = np.minimum((2.0 - 2.0 * cosine) / variance, CAP**2)
    return float(SHARE * left.sum(axis=1).min())
