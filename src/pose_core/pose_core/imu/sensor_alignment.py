r"""Sensor-to-segment alignment from motion: rotation of an IMU on its link, and its heading.

The cameras observe a link's axes :math:`d_k` in map with weights :math:`w_k`. For an IMU of
orientation :math:`R_{ws}`, the best sensor-to-segment rotation M, and heading ψ of its reference
frame, maximise

.. math:: J(\psi, M) = \sum_t \sum_k w_k\, d_k \cdot R_z(\psi)\,R_{ws}\,M\,e_k
          = \langle M, C(\psi) \rangle, \quad
          C(\psi) = \sum_t R_{ws}^T R_z(\psi)^T B, \quad B = \sum_k w_k\, d_k e_k^T

C is linear in :math:`(1, \cos\psi, \sin\psi)`, so three matrices accumulate all observations. For
each ψ the best M follows from a singular value decomposition (Wahba's problem). ψ is searched on a
grid and refined. The curvature of J gives the covariance, its second peak the ambiguity. Standing
still adds little information and does no harm; no posture is assumed to be neutral.

If the z axis of the IMU's reference frame points down (NED), :math:`F R_{ws}` with
F = diag(1, −1, −1) takes the place of :math:`R_{ws}`. Two more matrices accumulate C for that case.

References:
    Markley (1988), Attitude determination using vector observations and the singular value
    decomposition, J. Astronautical Sciences 36(3).
"""

from dataclasses import dataclass

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.body.joint_angles import wrapped
from pose_core.body.kinematics import skew
from pose_core.imu.sensor_to_segment import SensorToSegment
from pose_core.kernels.compiling import compiled
from pose_core.kernels.rotations import transposed_product

GRID = np.linspace(-np.pi, np.pi, 72, endpoint=False)  # [rad] grid of headings
REFINED = np.radians([2.5, 0.6, 0.15])  # [rad] steps of the parabolic refinement
MIN_HEADING_SEPARATION = np.radians(40.0)  # [rad] from which on a heading is another solution
HEADING_PARTS = np.array(
    [np.diag([0.0, 0.0, 1.0]), np.diag([1.0, 1.0, 0.0]), [[0, 1, 0], [-1, 0, 0], [0, 0, 0]]]
)
"""R_z(ψ)ᵀ = parts[0] + cos ψ parts[1] + sin ψ parts[2]."""
TURNED_OVER = np.diag([1.0, -1.0, -1.0])  # F
ALL_PARTS = np.concatenate([HEADING_PARTS, TURNED_OVER @ HEADING_PARTS[1:]])
"""The same, and F parts[1], F parts[2]; F parts[0] is -parts[0]."""
PRIOR_STDDEV = 1.0  # [rad] prior of sensor-to-segment rotation and heading about the best solution
MIN_UNKNOWN_HEADING_STDDEV = 1.0  # [rad] from it on, an IMU does not know north
NORTH_STDDEV = 0.3  # [rad] of an IMU's heading about that of the other IMUs that know north
DISTURBED_SHARE = 0.05  # [-] share of such IMUs in a more disturbed field


AXIS_STDDEV = 0.12  # [rad] of a link's axis by the cameras, in addition to the filter's
AXIS_LATE_S = 0.06  # [s] in addition for each unit of angular rate
UNKNOWN_AXIS = 0.7  # [rad] beyond which an axis is not used
SAMPLES_PER_S = 1.0 / 0.4  # [1/s] independent ones: correlation time of the cameras' errors
MEMORY_S = 60.0  # [s] time constant of the sums
MIN_LEAD = 4.0  # [-] required lead of the best heading in log-likelihood
MIN_LATER_LEAD = 2.0  # [-] the same after ``JUDGED_S``: upright, few headings are excluded
MIN_SPINE_LEAD = 1.0  # [-] the same of pelvis and trunk: who stays upright turns only about z
MAX_HEADING_STDDEV = 0.31  # [rad]
MAX_SPINE_HEADING_STDDEV = 0.45  # [rad] of these after ``JUDGED_S``: the rotation takes it up
MAX_TILT_STDDEV = 0.26  # [rad] about the axes across the link
JUDGED_S = 15.0  # [s] in view before a lack of fit or of lead is judged
MAX_MISFIT = 1.1  # [-] above which the IMU's motion does not fit the link
MAX_ARM_MISFIT = 4.5  # [-] the same for arms, where trackers have larger errors
STRICT_MISFIT = 1.5  # [-] the same for those that the cameras have contradicted repeatedly
KNOWN_MISFIT = 3.0
"""[-] times as much is allowed for a known alignment: a link that the other IMUs have steadied is
stated to be surer than its tracker's errors let it be."""


@dataclass(frozen=True, kw_only=True)
class Alignment:
    """One solution."""

    heading: float  # [rad] of the IMU's reference frame in map
    R_sensor_link: FloatArray  # (3, 3)
    covariance: FloatArray  # (4, 4) [rad²] of the rotation in the link's axes, and the heading
    lead: float  # [-] lead in log-likelihood over the next different solution


class SegmentAlignment:
    """Accumulates observations of one link and its IMU.

    Args:
        is_arm: Whether the link belongs to an arm.
        bend: Standard deviation of the link about its lateral axis against the IMU [rad], see
            :class:`pose_core.filter.tuning.ImuNoise`.
    """

    def __init__(self, *, is_arm: bool = False, bend: float = 0.0) -> None:
        self._bend_variance = bend**2
        self._most_misfit = MAX_ARM_MISFIT if is_arm else MAX_MISFIT
        self._sums: FloatArray = np.zeros((len(ALL_PARTS), 3, 3))
        self._total: FloatArray = np.zeros(2)  # weights, and durations of the axes, 3 s a second
        self.does_not_fit = False  # whether even the best solution does not fit
        self.z_down_lead = 0.0  # [-] of the case that z points down, in log-likelihood

    def clear(self) -> None:
        """Discard all observations."""
        self._sums[:], self._total[:], self.z_down_lead = 0.0, 0.0, 0.0

    def require_better_fit(self) -> None:
        """Require a better fit from now on: the cameras have contradicted an accepted one."""
        self._most_misfit = min(self._most_misfit, max(0.5 * self._most_misfit, STRICT_MISFIT))

    def turn_over(self) -> None:
        """Turn the reference frame over, in all observations so far."""
        self._sums = _turned_over(self._sums)
        self.z_down_lead = -self.z_down_lead

    def compare_z_down(self) -> None:
        """Compare the case that the reference frame's z axis points down with the other."""
        if np.any(self._sums):
            up, down = (
                best_fit(_cost_matrix(sums, GRID)).max()
                for sums in (self._sums, _turned_over(self._sums))
            )
            self.z_down_lead = float(SAMPLES_PER_S * (down - up))

    def observe(
        self,
        dt_s: float,
        R_world_sensor: FloatArray,
        R_map_link: FloatArray,
        covariance: FloatArray,
        rate: FloatArray,
    ) -> None:
        """Add the observation of one instant.

        Args:
            dt_s: Time that it stands for [s].
            R_world_sensor: Orientation of the IMU, (3, 3).
            R_map_link: Orientation of the link, (3, 3).
            covariance: Covariance of its error about map's axes, (3, 3) [rad²].
            rate: Angular velocity of the link [rad/s], (3,).
        """
        for sums in (self._sums, self._total):
            sums *= np.exp(-dt_s / MEMORY_S)
        accumulate(
            self._sums,
            self._total,
            dt_s,
            np.ascontiguousarray(R_world_sensor),
            np.ascontiguousarray(R_map_link),
            np.ascontiguousarray(covariance),
            AXIS_STDDEV**2 + AXIS_LATE_S**2 * float(rate @ rate),
            self._bend_variance,
        )

    def solve(
        self,
        known: SensorToSegment | None = None,
        north: float | None = None,
        *,
        is_doubtful: bool = False,
    ) -> Alignment | None:
        """Return the alignment, or None while it is too uncertain.

        Args:
            known: Known alignment of a calibration; then only the heading is estimated.
            north: Heading in map [rad] of the other IMUs that know north, if this one does.
            is_doubtful: Whether the known alignment may have changed; then it has to fit better.
        """
        if not np.any(self._sums):
            return None
        if known is None:
            found = best_alignment(self._sums, north)
        else:
            found = best_heading(self._sums, known)
        stddev = np.sqrt(np.diag(found.covariance))
        # Mean squared distance of the axes from the solution's, over its expected variance.
        weight, axis_s = self._total
        fitted = np.sum(found.R_sensor_link * _cost_matrix(self._sums, found.heading))
        is_trusted = known is not None and not is_doubtful
        most_misfit = self._most_misfit * (KNOWN_MISFIT if is_trusted else 1.0)
        fits = 2.0 * (weight - fitted) / max(axis_s, 1e-9) <= most_misfit
        is_long_seen = bool(self._total[1] > 3.0 * JUDGED_S)
        self.does_not_fit = bool(not fits and is_long_seen)
        least_lead, most_heading = MIN_LEAD, MAX_HEADING_STDDEV
        if is_long_seen:
            least_lead = MIN_LATER_LEAD
            if self._bend_variance > 0.0:
                least_lead, most_heading = MIN_SPINE_LEAD, MAX_SPINE_HEADING_STDDEV
        is_sure = fits and (
            found.lead > least_lead
            and stddev[3] < most_heading
            and max(stddev[0], stddev[1]) < MAX_TILT_STDDEV
        )
        return found if is_sure else None


@compiled
def accumulate(
    sums: FloatArray,
    total: FloatArray,
    dt_s: float,
    R_world_sensor: FloatArray,
    R_map_link: FloatArray,
    covariance: FloatArray,
    variance: float,
    bend_variance: float,
) -> None:
    """Add ∫ R_wsᵀ part B dt for each of all parts; B weights the link's axes.

    The error of an axis comes from rotations of the link about the other two axes, that about the
    lateral axis y with ``bend_variance`` in addition. ``total`` accumulates the weights and the
    durations for which axes were used.
    """
    about, B, turned = np.empty(3), np.empty((3, 3)), np.empty((3, 3))
    for k in range(3):
        about[k] = 0.0
        for i in range(3):
            for j in range(3):
                about[k] += R_map_link[i, k] * covariance[i, j] * R_map_link[j, k]
    about[1] += bend_variance
    for k in range(3):
        across = about.sum() - about[k]
        weight = dt_s / (across + variance) if across < UNKNOWN_AXIS**2 else 0.0
        total[0] += weight
        total[1] += dt_s if weight > 0.0 else 0.0
        for i in range(3):
            B[i, k] = weight * R_map_link[i, k]
    for part in range(len(sums)):
        transposed_product(R_world_sensor, np.dot(ALL_PARTS[part], B), turned)
        for i in range(3):
            for k in range(3):
                sums[part, i, k] += turned[i, k]


def best_alignment(sums: FloatArray, north: float | None) -> Alignment:
    """Maximise J; the solution with its covariance and its lead.

    Args:
        sums: See :func:`accumulate`, (5, 3, 3) [s/rad²].
        north: See :meth:`SegmentAlignment.solve`.
    """

    def fit(headings: FloatArray) -> FloatArray:
        J = best_fit(_cost_matrix(sums, headings))
        return J + _log_north_prior(headings, north) / SAMPLES_PER_S

    J = fit(GRID)
    heading = float(GRID[J.argmax()])
    for step in REFINED:
        left, here, right = fit(heading + step * np.array([-1.0, 0.0, 1.0]))
        bend = left - 2.0 * here + right
        if bend < 0.0:
            heading += float(np.clip(0.5 * step * (left - right) / bend, -2.0 * step, 2.0 * step))
    M = best_rotation(_cost_matrix(sums, heading))
    apart = np.abs(wrapped(GRID - heading)) > MIN_HEADING_SEPARATION
    near_north = north is not None and abs(wrapped(heading - north)) < MIN_HEADING_SEPARATION
    return Alignment(
        heading=float(wrapped(heading)),
        R_sensor_link=M,
        covariance=_covariance(sums, heading, M, NORTH_STDDEV if near_north else PRIOR_STDDEV),
        lead=float(SAMPLES_PER_S * (fit(np.array([heading]))[0] - J[apart].max())),
    )


def best_heading(sums: FloatArray, known: SensorToSegment) -> Alignment:
    """Maximise J over the heading only, for a known sensor-to-segment rotation, in closed form.

    Args:
        sums: See :func:`accumulate`, (5, 3, 3) [s/rad²].
        known: The known sensor-to-segment rotation.
    """
    M = known.R_sensor_segment
    cosine, sine = float(np.sum(M * sums[1])), float(np.sum(M * sums[2]))
    size = float(np.hypot(cosine, sine))
    covariance = np.diag([*np.square(known.stddev), 1.0 / (SAMPLES_PER_S * size + 1e-9)])
    # The opposite heading is the other solution.
    return Alignment(
        heading=float(np.arctan2(sine, cosine)),
        R_sensor_link=M,
        covariance=covariance,
        lead=2.0 * SAMPLES_PER_S * size,
    )


def _log_north_prior(headings: FloatArray, north: float | None) -> FloatArray:
    """Log-prior of headings, (n,), up to a constant: a normal distribution with outliers."""
    if north is None:
        return np.zeros(len(headings))
    distance = wrapped(headings - north) / NORTH_STDDEV
    return np.log(np.exp(-0.5 * distance**2) + DISTURBED_SHARE * NORTH_STDDEV)


def _turned_over(sums: FloatArray) -> FloatArray:
    """The sums of IMUs whose reference frame is turned over."""
    return np.concatenate([-sums[:1], sums[3:], sums[1:3]])


def _cost_matrix(sums: FloatArray, heading: FloatArray | float) -> FloatArray:
    """C of one heading, (3, 3), or of n, (n, 3, 3)."""
    cosine, sine = np.cos(heading), np.sin(heading)
    return np.asarray(
        sums[0] + np.multiply.outer(cosine, sums[1]) + np.multiply.outer(sine, sums[2])
    )


def best_rotation(C: FloatArray) -> FloatArray:
    """The rotation M that maximises ⟨M, C⟩; C is (..., 3, 3)."""
    U, _, Vt = np.linalg.svd(C)
    U[..., 2] *= np.sign(np.linalg.det(U @ Vt))[..., None]
    return U @ Vt


def best_fit(C: FloatArray) -> FloatArray:
    """The maximum of ⟨M, C⟩ over all rotations M; C is (..., 3, 3)."""
    singular = np.linalg.svd(C, compute_uv=False)
    fit: FloatArray = singular[..., 0] + singular[..., 1]
    return fit + np.sign(np.linalg.det(C)) * singular[..., 2]


def _covariance(
    sums: FloatArray, heading: float, M: FloatArray, heading_stddev: float
) -> FloatArray:
    """Inverse of J's curvature in (rotation, heading), with a prior, (4, 4) [rad²]."""
    cosine, sine = np.cos(heading), np.sin(heading)
    S = M.T @ _cost_matrix(sums, heading)
    slope = M.T @ (cosine * sums[2] - sine * sums[1])
    H = np.empty((4, 4))
    H[:3, :3] = np.trace(S) * np.eye(3) - 0.5 * (S + S.T)
    H[3, 3] = np.sum(M * (cosine * sums[1] + sine * sums[2]))
    H[:3, 3] = H[3, :3] = -np.einsum("kij,ij->k", skew(np.eye(3)), slope)
    stddev = np.array([PRIOR_STDDEV, PRIOR_STDDEV, PRIOR_STDDEV, heading_stddev])
    covariance = np.linalg.inv(SAMPLES_PER_S * H + np.diag(stddev**-2.0))
    return np.asarray(0.5 * (covariance + covariance.T), np.float64)
