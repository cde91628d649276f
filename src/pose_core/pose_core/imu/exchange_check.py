r"""Finds IMUs that are exchanged: worn on each other's segment.

A sensor that is fixed to a segment has an axis u along it. With the segment's direction a(t) as the
cameras measure it, and an unknown heading ψ of the sensor's world, the misfit of sensor i on
segment j is

.. math:: \chi^2_{ij} = \min_{\psi, u} \sum_t w_t\,|a_j - R_z(\psi)\,R_i\,u|^2
          = 2 \sum_t w_t - 2 \max_\psi \Big|\sum_t w_t\,R_i^T R_z(\psi)^T a_j\Big|

The sum is linear in :math:`(1, \cos\psi, \sin\psi)`, so that three vectors accumulate it. Sensors i
and j are exchanged if that explains both segments clearly better,
:math:`\chi^2_{ii} + \chi^2_{jj} - \chi^2_{ij} - \chi^2_{ji} > g`. Headings of sensors that
know north are expected near those of the others, which adds the log-prior to :math:`\chi^2`. That
they know it is what their covariance says; whether it is so, the other sensors' headings tell. The
filter's own rotations are not used: an IMU that takes part has turned them already.
"""

from collections.abc import Mapping

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.body.joint_angles import wrapped
from pose_core.imu.imu_history import ImuMeasurements
from pose_core.imu.sensor_alignment import HEADING_PARTS, MIN_UNKNOWN_HEADING_STDDEV
from pose_core.joints import JOINT_INDEX, SEGMENT_ENDS, other_side
from pose_core.stamps import NS_PER_S

PERIOD_NS = 160_000_000  # [ns] between two instants: errors of the cameras are correlated
MAX_STEP_S = 0.2  # [s] for which one instant stands at most
MEMORY_S = 60.0  # [s] time constant of the sums
DIRECTION_STDDEV = 0.12  # [rad] of a limb's direction by a camera
TRUNK_STDDEV = 0.18  # [rad] of the trunk's, which is not rigid
LATE_S = 0.1  # [s] in addition for each unit of the fastest sensor's rate
INDEPENDENT_S = 0.8  # [s] correlation time of these errors
COMMON_STDDEV = 0.35  # [rad] of the heading of one that knows north, about the others'
OTHER_SHARE = 0.07  # [-] of them whose heading may be any
SHARED = 0.5  # [-] prior probability that those which say so know north at all
EXCHANGE_GAIN = 30.0  # [-] g; 25 was the largest of sessions without exchanged sensors
SIDES_GAIN = 10.0  # [-] g of the left and the right one, which are exchanged most; likewise 4
_TURNS = np.radians(np.arange(0.0, 360.0, 6.0))
_NEAR = np.exp(-0.5 * (wrapped(_TURNS[:, None] - _TURNS) / COMMON_STDDEV) ** 2)
NEAR = (1.0 - OTHER_SHARE) * _NEAR / _NEAR.mean(axis=0) + OTHER_SHARE
"""[-] Density of a sensor's heading, if it shares another one, over that of any heading."""
HEADINGS = np.stack([np.ones_like(_TURNS), np.cos(_TURNS), np.sin(_TURNS)], axis=1)


class ExchangeCheck:
    """Accumulates the directions of all segments in all sensors' axes."""

    def __init__(self) -> None:
        self._stamp_ns = 0
        self._restart((), {})

    def is_due(self, stamp_ns: int, slips: Mapping[str, int]) -> bool:
        """Whether :meth:`add` needs an instant: late enough, or the first with another slip."""
        return slips != self._slips or not 0 <= stamp_ns - self._stamp_ns < PERIOD_NS

    def add(self, stamp_ns: int, positions: FloatArray, imus: ImuMeasurements) -> None:
        """Add one instant; those that follow within :data:`PERIOD_NS` are left out.

        Args:
            stamp_ns: The instant [ns].
            positions: Tracked joints by the cameras in map, without those of a side that the
                filter has exchanged, (sensors, 15, 3) [m]; NaN otherwise.
            imus: The IMUs at that instant; the sums restart if there is a new one, or a slip.
        """
        worn = [name for name in imus.segments if name in SEGMENT_ENDS]
        if not self._row.keys() >= set(worn) or imus.slips != self._slips:
            self._restart(tuple(sorted({*self._row, *worn})), imus.slips)
        since_ns = stamp_ns - self._stamp_ns
        if 0 <= since_ns < PERIOD_NS:
            return
        self._stamp_ns = stamp_ns
        dt_s = min(since_ns / NS_PER_S, MAX_STEP_S) if since_ns > 0 else 0.0
        keep = np.exp(-dt_s / MEMORY_S)
        self._sums *= keep
        self._weight *= keep
        rates = np.linalg.norm(imus.angular_velocity, axis=1)
        rate = float(np.max(rates, initial=0.0, where=np.isfinite(rates)))
        weight = dt_s / (self._variance + (LATE_S * rate) ** 2)
        rows = [self._row[name] for name in worn]
        stddev = imus.stddev[[imus.segments.index(name) for name in worn], 2]
        self._knows_north[rows] = stddev < MIN_UNKNOWN_HEADING_STDDEV
        R_world_sensor = imus.R_world_sensor[[imus.segments.index(name) for name in worn]]
        turned = np.swapaxes(R_world_sensor, 1, 2)[:, None] @ HEADING_PARTS
        for joints in positions[np.isfinite(positions[:, :, 0]).any(axis=1)]:
            bones = joints[self._ends[:, 0]] - joints[self._ends[:, 1]]
            length = np.linalg.norm(bones, axis=1)
            known = length > 0.0
            direction = np.where(known[:, None], bones, 0.0) / np.where(known, length, 1.0)[:, None]
            weights = np.where(known, weight, 0.0)
            self._sums[rows] += turned @ (weights[:, None] * direction).T
            self._weight[rows] += weights

    def _restart(self, segments: tuple[str, ...], slips: Mapping[str, int]) -> None:
        """Restart with the IMUs of these segments; not every one has a sample at each instant."""
        self._row = {segment: row for row, segment in enumerate(segments)}
        self._slips = dict(slips)
        ends = [[JOINT_INDEX[joint] for joint in SEGMENT_ENDS[name]] for name in segments]
        self._ends = np.array(ends, np.int64).reshape(-1, 2)
        stddev = [TRUNK_STDDEV if name == "torso" else DIRECTION_STDDEV for name in segments]
        self._variance = np.square(stddev)
        count = len(segments)
        self._sums = np.zeros((count, 3, 3, count))  # sensor, part of R_z, axis, segment
        self._weight = np.zeros((count, count))  # sensor, segment
        self._knows_north = np.zeros(count, np.bool_)

    def exchanged(self) -> Mapping[str, str]:
        """Segments whose sensors are exchanged, each with the other one."""
        segments = tuple(self._row)
        if len(segments) < 2:
            return {}
        gain = self._gains()
        found: dict[str, str] = {}
        for flat in np.argsort(gain, axis=None)[::-1].tolist():
            i, j = divmod(flat, len(gain))
            if gain[i, j] <= SIDES_GAIN:
                break
            one, other = segments[i], segments[j]
            if gain[i, j] <= (SIDES_GAIN if other == other_side(one) else EXCHANGE_GAIN):
                continue
            if one not in found and other not in found:
                found.update({one: other, other: one})
        return found

    def _gains(self) -> FloatArray:
        """Reduction of the misfit if two sensors are exchanged, (n, n) [-], symmetric."""
        fitted = np.tensordot(HEADINGS, self._sums, axes=(1, 1))
        fit = np.linalg.norm(fitted, axis=2)
        # Sensors without samples at some instants: all four misfits are taken for the same weight.
        own_weight = np.diag(self._weight)
        weight = np.minimum(np.minimum.outer(own_weight, own_weight), self._weight)
        weight = np.minimum(weight, weight.T)
        misfit = 2.0 * (1.0 - fit / np.maximum(self._weight, 1e-9)) / INDEPENDENT_S
        own = np.einsum("hii->hi", misfit)
        prior = -2.0 * self._log_heading_prior(own * own_weight)
        on_own = (weight * own[:, :, None] + prior).min(axis=0)
        on_other = (weight * misfit + prior).min(axis=0)
        return np.asarray(on_own + on_own.T - on_other - on_other.T)

    def _log_heading_prior(self, misfit: FloatArray) -> FloatArray:
        r"""Log-prior of each sensor's heading by the others, without that of the segment it is on.

        Sensors that know north have nearly the same heading :math:`\psi_0`; the others' is as
        likely as their own segments allow, :math:`L_k`. Without it, a leg that swings forwards is
        one that swings backwards in a world that is turned over. With :math:`n` for :data:`NEAR`,
        :math:`q` for the probability that headings are shared, and k for the other sensors that
        say that they know north:

        .. math:: p(\psi_0) = \prod_k \frac{\sum_\psi n(\psi, \psi_0)\,L_k(\psi)}
                  {\sum_\psi L_k(\psi)}, \quad
                  q = \frac{q_0 \bar p}{q_0 \bar p + 1 - q_0}

        The prior is :math:`1 - q + q\,\sum n(\psi, \psi_0)\,p(\psi_0) / \sum p(\psi_0)`.

        Args:
            misfit: Of each sensor on its own segment, (headings, n).

        Returns:
            Of sensor i, if it is compared with j, (headings, n, n).
        """
        likelihood = np.exp(0.5 * (misfit.min(axis=0) - misfit))
        votes = np.log(NEAR @ (likelihood / likelihood.sum(axis=0)))
        votes[:, ~self._knows_north] = 0.0
        log_p = votes.sum(axis=1)[:, None, None] - votes[:, :, None] - votes[:, None]
        p = np.exp(log_p)
        evidence = SHARED * p.mean(axis=0)
        q = evidence / (evidence + 1.0 - SHARED)
        prior = np.log(1.0 - q + q * np.tensordot(NEAR, p / p.sum(axis=0), axes=1))
        return np.where(self._knows_north[:, None], prior, 0.0)
