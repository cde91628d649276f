r"""Sensor-to-segment alignment of all IMUs, from an N-pose and free movement.

With the sensor's orientation :math:`R_{ws}(t)`, its world's heading against map :math:`y + d\,t`,
and its alignment :math:`M = R_{sensor,segment}`, the segment's orientation is

.. math:: R(t) = R_z(y + d\,t)\; R_{ws}(t)\; M

The unknowns are every IMU's :math:`y, d, M`, the cameras' bias :math:`b` of its segment's long
axis, which turns with the body, and the heading :math:`\psi` of the N-pose. The measurements are

- the N-pose, :math:`R(0) = R_z(\psi)`: it gives the alignment's tilt, by gravity;
- the long axes measured by the cameras, :math:`R\,e_z + b = a`: they give the heading;
- the lines of shoulders and hips, :math:`R\,e_y = l`;
- knees, hinges common to both segments: :math:`R_{thigh}\,e_y = R_{shank}\,e_y`;
- elbows, whose hinge is orthogonal to the forearm's long axis:
  :math:`(R_{upper}\,e_y) \cdot (R_{forearm}\,e_z) = 0`.

The last two need no camera (Seel, Schauer and Raisch (2012), IEEE MSC, for the hinge; Laidig,
Müller and Seel (2017), Current Directions in Biomedical Engineering 3(2), for the elbow).
Gauss-Newton with Huber's weights; the inverse of the normal matrix is the covariance. An axis that
no motion has excited keeps the value from the N-pose.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from pose_calibration.imus.n_pose import about_z
from pose_calibration.imus.observations import PERIOD_NS, ImuObservations
from pose_core.api import FloatArray, SensorToSegment
from pose_core.finite_numbers import are_known, mean_known
from pose_core.joints import SIDES

AXIS_STDDEV = math.radians(5.0)  # [rad] of a limb's direction measured by the cameras
TRUNK_STDDEV = math.radians(8.0)  # [rad] the same of the trunk, which bends
LAG_S = 0.1  # [s] lag of a tracker behind a rotating limb
BIAS_STDDEV = math.radians(4.0)  # [rad] of b
LINE_STDDEV = math.radians(10.0)  # [rad] of the shoulders' and the hips' line
HINGE_STDDEV = math.radians(2.0)  # [rad] of a knee
ELBOW_STDDEV = math.radians(3.0)  # [rad] of the right angle between an elbow's axis and the forearm
TILT_STDDEV = math.radians(3.0)  # [rad] of a segment's inclination in the N-pose
ARM_TILT_STDDEV = math.radians(8.0)  # [rad] the same of arms, which are slightly abducted and bent
TURN_STDDEV = math.radians(8.0)  # [rad] of a segment's rotation about the vertical in the N-pose
STAND_HEADING_STDDEV = math.radians(8.0)  # [rad] of ψ measured by the cameras
DRIFT_STDDEV = math.radians(1.0) / 60.0  # [rad/s] of d
CORRELATION_S = 0.8  # [s] correlation time of the errors
LIMIT = 2.0  # [-] standard deviations, Huber's threshold
ITERATIONS = 30
CONVERGED = 1e-5  # [rad] a smaller step ends the iteration
OWN = 8  # [-] unknowns of an IMU: y, d, the alignment's rotation (3), b (3)
MOVING = range(5)  # y, d, the alignment: unknowns of the segment's orientation
ARMS = ("upper_arm", "forearm")
TRUNK = ("pelvis", "torso", "head")
_, Y, Z = np.eye(3)
KNEES = tuple((f"{side}_thigh", f"{side}_shank") for side in SIDES)
ELBOWS = tuple((f"{side}_upper_arm", f"{side}_forearm") for side in SIDES)


@dataclass(frozen=True)
class _Residuals:
    """One kind of residual at m instants, in units of its standard deviation."""

    columns: NDArray[np.intp]  # (c,) the unknowns it depends on
    residual: FloatArray  # (m, r)
    jacobian: FloatArray  # (m, r, c)
    share: float = 1.0  # [-] independent measurements per instant


def fit_alignments(observations: ImuObservations) -> dict[str, SensorToSegment]:
    """Estimate the alignments of all IMUs that had samples during the N-pose, by segment.

    Args:
        observations: Measurements of an N-pose and the motion after it.
    """
    fit = _Fit(observations)
    for _ in range(ITERATIONS):
        if fit.step() < CONVERGED:
            break
    return fit.alignments()


def axis_stddev(segment: str) -> float:
    """Standard deviation [rad] of a segment's long axis measured by the cameras at rest."""
    return TRUNK_STDDEV if segment in TRUNK else AXIS_STDDEV


class _Fit:
    """State of the Gauss-Newton iteration."""

    def __init__(self, o: ImuObservations) -> None:
        self._o = o
        heard = np.isfinite(o.R_world_sensor[o.is_neutral][:, :, 0, 0]).any(axis=0)
        self._rows = np.flatnonzero(heard).tolist()
        self._segments = [o.segments[i] for i in self._rows]
        self._R_ws = o.R_world_sensor[:, self._rows]
        standing = self._R_ws[o.is_neutral].swapaxes(0, 1)
        known = [Rotation.from_matrix(each[np.isfinite(each[:, 0, 0])]) for each in standing]
        self._R_ws_neutral = np.stack([each.mean().as_matrix() for each in known])
        self._psi = o.neutral_heading
        count = len(self._segments)
        self._y, self._d, self._b = np.zeros(count), np.zeros(count), np.zeros((count, 3))
        for i, row in enumerate(self._rows):
            vertical = self._R_ws[:, i] @ (self._R_ws_neutral[i].T @ Z)
            first, second = (a[:, 0] + 1j * a[:, 1] for a in (vertical, o.long_axis[:, row]))
            self._y[i] = np.angle(np.nansum(second * np.conj(first)))  # 0 if none is known
        self._first_y = self._y.copy()
        turn = about_z(self._psi - self._y)
        self._M = self._R_ws_neutral.swapaxes(1, 2) @ turn
        self._normal = np.zeros((OWN * count + 1, OWN * count + 1))

    def step(self) -> float:
        """One Gauss-Newton step; returns the largest change [rad]."""
        normal, gradient = np.zeros_like(self._normal), np.zeros(len(self._normal))
        for m in self._residuals():
            size = np.linalg.norm(m.residual, axis=1)
            weight = m.share * np.minimum(1.0, LIMIT / np.maximum(size, LIMIT))
            weighted = weight[:, None, None] * m.jacobian
            normal[np.ix_(m.columns, m.columns)] += np.einsum("kri,krj->ij", weighted, m.jacobian)
            gradient[m.columns] += np.einsum("kri,kr->i", weighted, m.residual)
        self._normal = normal
        change = -np.linalg.solve(normal, gradient)
        own = change[:-1].reshape(-1, OWN)
        self._y += own[:, 0]
        self._d += own[:, 1]
        self._M = self._M @ Rotation.from_rotvec(own[:, 2:5]).as_matrix()
        self._b += own[:, 5:]
        self._psi += change[-1]
        return float(np.abs(np.delete(own, 1, axis=1)).max())

    def alignments(self) -> dict[str, SensorToSegment]:
        """The alignments by segment."""
        stddev = np.sqrt(np.diag(np.linalg.inv(self._normal)))[:-1].reshape(-1, OWN)[:, 2:5]
        bias = np.einsum("nij,sj->nsi", self._o.R_map_heading, self._b)
        miss = self._rotations()[..., 2] + bias - self._o.long_axis[:, self._rows]
        squares = np.sum(miss**2, axis=-1)
        return {
            segment: SensorToSegment(
                R_sensor_segment=self._M[i],
                stddev=stddev[i],
                residual=math.sqrt(mean_known(squares[:, i])),
            )
            for i, segment in enumerate(self._segments)
        }

    def _rotations(self) -> FloatArray:
        """Orientation of every segment in map at all instants, (n, s, 3, 3)."""
        heading = self._y + self._d * self._o.times_s[:, None]
        return np.asarray(about_z(heading) @ self._R_ws @ self._M)

    def _residuals(self) -> Iterator[_Residuals]:
        R = self._rotations()
        o, index = self._o, {segment: i for i, segment in enumerate(self._segments)}
        for i, row in enumerate(self._rows):
            yield self._long_axis(R, i, row)
            if self._segments[i] in ("pelvis", "torso"):
                residual = (R[:, i, :, 1] - o.line[:, row]) / LINE_STDDEV
                jacobian = self._axis_jacobian(R[:, i], Y) / LINE_STDDEV
                yield _repeated(_columns(MOVING, i), residual, jacobian)
            yield self._neutral(i)
            yield self._prior(i)
        for pairs, hinge in ((KNEES, self._knee), (ELBOWS, self._elbow)):
            for upper, lower in pairs:
                if upper in index and lower in index:
                    yield hinge(R, index[upper], index[lower])
        heading = (self._psi - o.neutral_heading) / STAND_HEADING_STDDEV
        jacobian = np.array([[[1.0 / STAND_HEADING_STDDEV]]])
        yield _Residuals(np.array([len(self._normal) - 1]), np.array([[heading]]), jacobian)

    def _long_axis(self, R: FloatArray, i: int, row: int) -> _Residuals:
        o = self._o
        stddev = np.hypot(axis_stddev(self._segments[i]), LAG_S * o.rate[:, row])[:, None]
        residual = (R[:, i, :, 2] + o.R_map_heading @ self._b[i] - o.long_axis[:, row]) / stddev
        moving = self._axis_jacobian(R[:, i], Z)
        jacobian = np.concatenate([moving, o.R_map_heading], axis=2) / stddev[..., None]
        return _repeated(_columns(range(OWN), i), residual, jacobian)

    def _knee(self, R: FloatArray, upper: int, lower: int) -> _Residuals:
        residual = (R[:, upper, :, 1] - R[:, lower, :, 1]) / HINGE_STDDEV
        first, second = (self._axis_jacobian(R[:, i], Y) for i in (upper, lower))
        jacobian = np.concatenate([first, -second], axis=2) / HINGE_STDDEV
        return _repeated(_columns(MOVING, upper, lower), residual, jacobian)

    def _elbow(self, R: FloatArray, upper: int, lower: int) -> _Residuals:
        hinge, along = R[:, upper, :, 1], R[:, lower, :, 2]
        residual = np.sum(hinge * along, axis=1, keepdims=True) / ELBOW_STDDEV
        first = np.einsum("nr,nrc->nc", along, self._axis_jacobian(R[:, upper], Y))
        second = np.einsum("nr,nrc->nc", hinge, self._axis_jacobian(R[:, lower], Z))
        jacobian = np.concatenate([first, second], axis=1)[:, None] / ELBOW_STDDEV
        return _repeated(_columns(MOVING, upper, lower), residual, jacobian)

    def _neutral(self, i: int) -> _Residuals:
        tilt = ARM_TILT_STDDEV if self._segments[i].endswith(ARMS) else TILT_STDDEV
        stddev = np.array([tilt, tilt, TURN_STDDEV])
        R = about_z(self._y[i] - self._psi) @ self._R_ws_neutral[i] @ self._M[i]
        up = R[2]  # the vertical in the segment's axes
        jacobian = np.column_stack([up, np.eye(3), -up]) / stddev[:, None]
        columns = np.append(_columns((0, 2, 3, 4), i), len(self._normal) - 1)
        residual = Rotation.from_matrix(R).as_rotvec() / stddev
        return _Residuals(columns, residual[None], jacobian[None])

    def _prior(self, i: int) -> _Residuals:
        stddev = np.array([math.pi, DRIFT_STDDEV, BIAS_STDDEV, BIAS_STDDEV, BIAS_STDDEV])
        heading = self._y[i] - self._first_y[i]  # unobservable if always vertical
        residual = np.array([heading, self._d[i], *self._b[i]]) / stddev
        jacobian = np.diag(1.0 / stddev)
        return _Residuals(_columns((0, 1, 5, 6, 7), i), residual[None], jacobian[None])

    def _axis_jacobian(self, R: FloatArray, axis: FloatArray) -> FloatArray:
        """Jacobian of R axis by y, d and a rotation of the alignment: (n, 3, 5)."""
        a = R @ axis
        by_heading = np.stack([-a[:, 1], a[:, 0], np.zeros(len(a))], axis=1)
        by_alignment = R @ np.cross(np.eye(3), axis).T  # R (m x axis)
        by_drift = by_heading * self._o.times_s[:, None]
        return np.concatenate([by_heading[..., None], by_drift[..., None], by_alignment], axis=2)


def _columns(own: Sequence[int], *imus: int) -> NDArray[np.intp]:
    """Columns of some unknowns of each IMU, one IMU after the other."""
    return (OWN * np.array(imus)[:, None] + np.array(own)).ravel()


def _repeated(columns: NDArray[np.intp], residual: FloatArray, jacobian: FloatArray) -> _Residuals:
    """Select the known residuals; successive instants are correlated."""
    known = are_known(residual) & are_known(jacobian).all(axis=1)
    share = PERIOD_NS * 1e-9 / CORRELATION_S
    return _Residuals(columns, residual[known], jacobian[known], share)
