r"""Sensor-to-segment alignment from motion: an IMU's mounting on its link, and its world's heading.

Where cameras show a link's axes :math:`d_k` in map with weights :math:`w_k`, an IMU of orientation
:math:`R_{ws}` fits best with the mounting M and the heading ψ that maximise

.. math:: J(\psi, M) = \sum_t \sum_k w_k\, d_k \cdot R_z(\psi)\,R_{ws}\,M\,e_k
          = \langle M, C(\psi) \rangle, \quad
          C(\psi) = \sum_t R_{ws}^T R_z(\psi)^T B, \quad B = \sum_k w_k\, d_k e_k^T

C is linear in :math:`(1, \cos\psi, \sin\psi)`, so three matrices hold all that was ever seen, and
for each ψ the best M is a singular value decomposition (Wahba's problem). ψ is searched on a grid
and refined. J's curvature tells how surely both are known, its second peak whether they are
ambiguous. Standing still adds little by itself and harms nothing; no posture is taken for zero.

References:
    Markley (1988), Attitude determination using vector observations and the singular value
    decomposition, J. Astronautical Sciences 36(3).
"""

from dataclasses import dataclass

import numpy as np

from pose_core.imu.sensor_to_segment import SensorToSegment
from pose_core.kernels.compiling import compiled
from pose_core.kernels.rotations import transposed_product
from pose_core.streams.samples import FloatArray

GRID = np.linspace(-np.pi, np.pi, 72, endpoint=False)  # [rad] headings that are tried
REFINED = np.radians([2.5, 0.6, 0.15])  # [rad] steps of the parabolas around the best
APART = np.radians(40.0)  # from which on another heading is another answer
HEADING_PARTS = np.array(
    [np.diag([0.0, 0.0, 1.0]), np.diag([1.0, 1.0, 0.0]), [[0, 1, 0], [-1, 0, 0], [0, 0, 0]]]
)
"""R_z(ψ)ᵀ = parts[0] + cos ψ parts[1] + sin ψ parts[2]."""
GENERATORS = np.array(
    [
        [[0, 0, 0], [0, 0, -1], [0, 1, 0]],
        [[0, 0, 1], [0, 0, 0], [-1, 0, 0]],
        [[0, -1, 0], [1, 0, 0], [0, 0, 0]],
    ],
    float,
)
"""Of rotations about x, y, z."""
PRIOR_STDDEV = 1.0  # [rad] of mounting and heading about the best answer
NORTH_STDDEV = 0.3  # [rad] of an IMU's heading about those of the others that know north
ASTRAY = 0.05  # [-] share of such IMUs whose field is bent farther


@dataclass(frozen=True, kw_only=True)
class AlignmentTuning:
    """When motion has told enough."""

    axis_stddev: float = 0.12  # [rad] of a link's axis as cameras show it, beyond the filter's own
    axis_late: float = 0.06  # [s] more per angular rate
    unknown_axis: float = 0.35  # [rad] beyond which an axis is not used
    independent_s: float = 0.4  # [s] after which a camera's error is another one
    memory: float = 60.0  # [s] of what was seen
    gap: float = 4.0  # [-] log-likelihood by which the best heading leads
    heading_stddev: float = 0.31  # [rad] at most
    tilt_stddev: float = 0.26  # [rad] at most, about the axes across the link
    covariance_factor: float = 0.7  # [-] of what is handed to the filter
    misfit: float = 1.1  # [-] from which on the IMU moves unlike the link
    arm_misfit: float = 3.0  # [-] the same of arms, which trackers mistake more


@dataclass(frozen=True, kw_only=True)
class Alignment:
    """One answer."""

    heading: float  # [rad] of the IMU's world in map
    R_sensor_link: FloatArray  # (3, 3)
    covariance: FloatArray  # (4, 4) [rad²] of the mounting in the link's axes, and the heading
    gap: float  # [-] log-likelihood by which it leads


class SegmentAlignment:
    """Gathers what is seen of one link and its IMU.

    Args:
        tuning: See :class:`AlignmentTuning`.
        is_arm: Whether the link is an arm's.
    """

    def __init__(self, tuning: AlignmentTuning, *, is_arm: bool = False) -> None:
        self._tuning = tuning
        self._most_misfit = tuning.arm_misfit if is_arm else tuning.misfit
        self._sums: FloatArray = np.zeros((3, 3, 3))
        self._total: FloatArray = np.zeros(2)
        self.is_unlike = False  # whether even the best answer does not fit

    def clear(self) -> None:
        """Forget what was seen."""
        self._sums[:], self._total[:] = 0.0, 0.0

    def observe(
        self,
        dt_s: float,
        R_world_sensor: FloatArray,
        R_map_link: FloatArray,
        covariance: FloatArray,
        rate: FloatArray,
    ) -> None:
        """Take one instant.

        Args:
            dt_s: Time that it stands for [s].
            R_world_sensor: Orientation of the IMU, (3, 3).
            R_map_link: Orientation of the link, (3, 3).
            covariance: Of its error about map's axes, (3, 3) [rad²].
            rate: Angular velocity of the link [rad/s], (3,).
        """
        tuning = self._tuning
        for sums in (self._sums, self._total):
            sums *= np.exp(-dt_s / tuning.memory)
        accumulate(
            self._sums,
            self._total,
            dt_s,
            np.ascontiguousarray(R_world_sensor),
            np.ascontiguousarray(R_map_link),
            np.ascontiguousarray(covariance),
            tuning.axis_stddev**2 + tuning.axis_late**2 * float(rate @ rate),
            tuning.unknown_axis**2,
        )

    def solve(
        self, mounting: SensorToSegment | None = None, north: float | None = None
    ) -> Alignment | None:
        """The alignment, if it is known surely enough.

        Args:
            mounting: How the IMU sits, where a calibration has told; only the heading is sought.
            north: Heading of the other IMUs' world in map [rad], where this one shares it.
        """
        if not np.any(self._sums):
            return None
        samples_per_s = 1.0 / self._tuning.independent_s
        if mounting is None:
            found = best_alignment(self._sums, samples_per_s, north)
        else:
            found = best_heading(self._sums, samples_per_s, mounting)
        stddev = np.sqrt(np.diag(found.covariance))
        misfit = self._misfit(found)
        self.is_unlike = misfit > self._most_misfit
        is_sure = not self.is_unlike and (
            found.gap > self._tuning.gap
            and stddev[3] < self._tuning.heading_stddev
            and max(stddev[0], stddev[1]) < self._tuning.tilt_stddev
        )
        return found if is_sure else None

    def _misfit(self, found: Alignment) -> float:
        """Mean squared distance of the axes from where the answer has them, over its variance."""
        weight, axis_s = self._total
        C = _cost_matrix(self._sums, found.heading)
        return float(2.0 * (weight - np.sum(found.R_sensor_link * C)) / max(axis_s, 1e-9))


@compiled
def accumulate(
    sums: FloatArray,
    total: FloatArray,
    dt_s: float,
    R_world_sensor: FloatArray,
    R_map_link: FloatArray,
    covariance: FloatArray,
    variance: float,
    unknown_variance: float,
) -> None:
    """Add ∫ R_wsᵀ part B dt for each part of the heading; B weights the link's axes.

    An axis's error comes from the link's turns about the two others. ``total`` is given the sum of
    all weights and for how long axes were used.
    """
    about, B, turned = np.empty(3), np.empty((3, 3)), np.empty((3, 3))
    for k in range(3):
        about[k] = 0.0
        for i in range(3):
            for j in range(3):
                about[k] += R_map_link[i, k] * covariance[i, j] * R_map_link[j, k]
    for k in range(3):
        across = about.sum() - about[k]
        weight = dt_s / (across + variance) if across < unknown_variance else 0.0
        total[0] += weight
        total[1] += dt_s if weight > 0.0 else 0.0
        for i in range(3):
            B[i, k] = weight * R_map_link[i, k]
    for part in range(3):
        transposed_product(R_world_sensor, np.dot(HEADING_PARTS[part], B), turned)
        for i in range(3):
            for k in range(3):
                sums[part, i, k] += turned[i, k]


def best_alignment(sums: FloatArray, samples_per_s: float, north: float | None = None) -> Alignment:
    """The maximum of J, its covariance and its lead.

    Args:
        sums: See :func:`accumulate`, (3, 3, 3) [s/rad²].
        samples_per_s: Independent samples a second.
        north: See :meth:`SegmentAlignment.solve`.
    """

    def fit(heading: float) -> float:
        return _best_rotation(sums, heading)[1] + _of_north(heading, north) / samples_per_s

    J = np.array([fit(heading) for heading in GRID])
    heading = float(GRID[J.argmax()])
    for step in REFINED:
        left, here, right = (fit(heading + k * step) for k in (-1, 0, 1))
        bend = left - 2.0 * here + right
        if bend < 0.0:
            heading += float(np.clip(0.5 * step * (left - right) / bend, -2.0 * step, 2.0 * step))
    M = _best_rotation(sums, heading)[0]
    apart = np.abs(_turn(GRID - heading)) > APART
    near_north = north is not None and abs(_turn(heading - north)) < APART
    return Alignment(
        heading=float(_turn(heading)),
        R_sensor_link=M,
        covariance=_covariance(
            sums, heading, M, samples_per_s, NORTH_STDDEV if near_north else PRIOR_STDDEV
        ),
        gap=float(samples_per_s * (fit(heading) - J[apart].max())),
    )


def best_heading(sums: FloatArray, samples_per_s: float, mounting: SensorToSegment) -> Alignment:
    """The same for a mounting that is known: only the heading is sought, in closed form."""
    M = mounting.R_sensor_segment
    cosine, sine = float(np.sum(M * sums[1])), float(np.sum(M * sums[2]))
    size = float(np.hypot(cosine, sine))
    covariance = np.diag([*np.square(mounting.stddev), 1.0 / (samples_per_s * size + 1e-9)])
    # The opposite heading is the other answer.
    return Alignment(
        heading=float(np.arctan2(sine, cosine)),
        R_sensor_link=M,
        covariance=covariance,
        gap=2.0 * samples_per_s * size,
    )


def _turn(angle: FloatArray | float) -> FloatArray:
    """Angles [rad] within half a turn."""
    return np.asarray(np.angle(np.exp(1j * np.asarray(angle))), np.float64)


def _of_north(heading: float, north: float | None) -> float:
    """Log of the share of IMUs with this heading, but for a constant; some are far astray."""
    if north is None:
        return 0.0
    distance = float(_turn(heading - north)) / NORTH_STDDEV
    return float(np.log(np.exp(-0.5 * distance**2) + ASTRAY * NORTH_STDDEV))


def _cost_matrix(sums: FloatArray, heading: float) -> FloatArray:
    C: FloatArray = sums[0] + np.cos(heading) * sums[1] + np.sin(heading) * sums[2]
    return C


def _best_rotation(sums: FloatArray, heading: float) -> tuple[FloatArray, float]:
    """The rotation that maximises ⟨M, C⟩, and that maximum."""
    U, singular, Vt = np.linalg.svd(_cost_matrix(sums, heading))
    sign = np.sign(np.linalg.det(U @ Vt))
    return (U * [1.0, 1.0, sign]) @ Vt, float(singular[0] + singular[1] + sign * singular[2])


def _covariance(
    sums: FloatArray, heading: float, M: FloatArray, samples_per_s: float, heading_stddev: float
) -> FloatArray:
    """Inverse of J's curvature by (mounting, heading), with a prior, (4, 4) [rad²]."""
    cosine, sine = np.cos(heading), np.sin(heading)
    S = M.T @ _cost_matrix(sums, heading)
    slope = M.T @ (cosine * sums[2] - sine * sums[1])
    H = np.empty((4, 4))
    H[:3, :3] = np.trace(S) * np.eye(3) - 0.5 * (S + S.T)
    H[3, 3] = np.sum(M * (cosine * sums[1] + sine * sums[2]))
    H[:3, 3] = H[3, :3] = -np.einsum("kij,ij->k", GENERATORS, slope)
    stddev = np.array([PRIOR_STDDEV, PRIOR_STDDEV, PRIOR_STDDEV, heading_stddev])
    covariance = np.linalg.inv(samples_per_s * H + np.diag(stddev**-2.0))
    return np.asarray(0.5 * (covariance + covariance.T), np.float64)
