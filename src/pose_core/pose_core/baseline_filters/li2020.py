"""The filter of li2020: an unscented Kalman filter of 24 degrees of freedom and their rates.

State x = (DOF, rates) in R⁴⁸; F = [[I, Δt I], [0, I]] (11); h is forward kinematics; the
measurement noise comes from the data (12), (13) and weights the sensors (14), (15).
"""

import numpy as np
from scipy.spatial.transform import Rotation

from pose_core.arrays import FloatArray
from pose_core.baseline_filters.measurement_noise import fuse_measurements, measurement_noise
from pose_core.baseline_filters.unscented import UnscentedTransform, kalman_update
from pose_core.body.inverse_kinematics import dof_from_positions
from pose_core.body.kinematics import ForwardKinematics, left_jacobian
from pose_core.body.model import ROOT_DOF, BodyModel
from pose_core.body.shape import BodyShape
from pose_core.body.trunk import trunk_axes
from pose_core.finite_numbers import are_known

FRAME_PERIOD_S = 1.0 / 30.0  # for which the constant Q is defined
MAX_ANGLE_STDDEV = np.radians(60.0)  # bound of unobserved rotations: sigma points would wrap
BALL_JOINT = 3  # degrees of freedom; the last one is the axial rotation
ROOT_ACCELERATION = 5.0  # [m/s²] process noise of the root's position
ANGULAR_ACCELERATION = 25.0  # [rad/s²] process noise of every rotation
POSITION_STDDEV = 0.05  # [m] initial, of the root
ANGLE_STDDEV = 0.2  # [rad] initial, of every rotation
RATE_STDDEV = 0.5  # [m/s], [rad/s] initial
ALPHA = 0.1  # [-] spread of the sigma points, in units of √n standard deviations
RE_REFERENCE_ANGLE = 1.0  # [rad] bound of the root's rotation vector, well inside its chart


class Li2020Filter:
    """One person's degrees of freedom, rates and their covariance.

    Args:
        model: A body model.
        shape: The person's measures.
    """

    def __init__(self, model: BodyModel, shape: BodyShape) -> None:
        self.model = model
        self._size = model.size
        self.kinematics = ForwardKinematics(model, shape.offsets)
        self._transform = UnscentedTransform(2 * model.size, alpha=ALPHA)
        self._Q = self._process_noise()
        balls = (link.dof for link in model.links.values() if len(link.dof) == BALL_JOINT)
        self._turns = np.array([model.dof_index[dof[-1].name] for dof in balls])
        self._mean, self._covariance = np.zeros(2 * model.size), np.eye(2 * model.size)

    @property
    def dof(self) -> FloatArray:
        """Root position [m], rotation vector from the reference [rad], angles [rad]; shape (d,)."""
        return self._mean[: self._size]

    @property
    def rates(self) -> FloatArray:
        """Rates of ``dof``, [m/s] and [rad/s], shape (d,)."""
        return self._mean[self._size :]

    @property
    def covariance(self) -> FloatArray:
        """Covariance of ``dof``, shape (d, d)."""
        return self._covariance[: self._size, : self._size]

    @property
    def state(self) -> tuple[FloatArray, FloatArray]:
        """Mean, (2 d,), and covariance, (2 d, 2 d), of ``dof`` and ``rates``."""
        return self._mean.copy(), self._covariance.copy()

    def start(self, positions: FloatArray) -> bool:
        """Initialise from one pose, shape (15, 3) [m]; False if its trunk is not seen."""
        axes = trunk_axes(positions)
        if not np.all(np.isfinite(axes)):
            return False
        d = self._size
        self.kinematics.R_reference = axes
        self._mean = np.zeros(2 * d)
        self._mean[:d] = dof_from_positions(self.model, positions)
        stddev = np.full(2 * d, ANGLE_STDDEV)
        stddev[:3] = POSITION_STDDEV
        stddev[d:] = RATE_STDDEV
        self._covariance = np.diag(stddev**2)
        return True

    def step(self, dt_s: float, measured: FloatArray) -> FloatArray:
        """Predict by ``dt_s`` and update with the sensors' measurements.

        Args:
            dt_s: Time since the last step [s].
            measured: Joints of each sensor in map, shape (sensors, 15, 3) [m]; NaN unseen.

        Returns:
            Distance from the predicted to the fused joints, shape (15,) [m]; NaN unseen.

        Raises:
            numpy.linalg.LinAlgError: If a covariance lost its positive definiteness.
        """
        d = self._size
        points = self._transform.sigma_points(self._mean, self._covariance)
        points[:, :d] += dt_s * points[:, d:]  # li2020 (11)
        state = self._transform.moments(points)  # li2020 (3)
        covariance = state.covariance + self._Q  # li2020 (4)

        predicted = self.kinematics.pose(points[:, :d]).positions.reshape(len(points), -1)
        measurement = self._transform.moments(predicted)  # li2020 (5)
        z = measured.reshape(len(measured), -1)
        noise = measurement_noise(z, measurement.mean, np.diag(measurement.covariance))
        fused, R = fuse_measurements(z, noise, measurement.mean)

        self._mean, self._covariance = kalman_update(
            state.mean,
            covariance,
            self._transform.cross_covariance(state, measurement),
            fused - measurement.mean,  # li2020 (7)
            measurement.covariance + np.diag(R),  # li2020 (6)
        )
        self._bound_angles()
        self._bound_turns()
        self._re_reference()
        distance = np.linalg.norm((fused - measurement.mean).reshape(-1, 3), axis=-1)
        return np.where(are_known(measured).any(axis=0), distance, np.nan)

    def _process_noise(self) -> FloatArray:
        from filterpy.common import Q_discrete_white_noise  # imports scipy.stats, see unscented

        d = self._size
        acceleration = np.full(d, ANGULAR_ACCELERATION)
        acceleration[:3] = ROOT_ACCELERATION
        block = Q_discrete_white_noise(dim=2, dt=FRAME_PERIOD_S, var=1.0)
        return np.kron(block, np.diag(acceleration**2))

    def _bound_angles(self) -> None:
        """Bound the uncertainty of unobserved rotations, so that sigma points do not wrap."""
        d = self._size
        stddev = np.sqrt(np.diag(self._covariance)[ROOT_DOF:d])
        scale = np.ones(2 * d)
        scale[ROOT_DOF:d] = np.minimum(1.0, MAX_ANGLE_STDDEV / stddev)
        if np.any(scale < 1.0):
            self._covariance = np.outer(scale, scale) * self._covariance

    def _bound_turns(self) -> None:
        """Bound the axial rotation of a limb by the joint's limits.

        While the limb is straight it is not measured, and a wrong rate would make it wind up.
        """
        d = self._size
        lower, upper = self.model.limits[self._turns - ROOT_DOF].T
        bounded = np.clip(self._mean[self._turns], lower, upper)
        is_beyond = bounded != self._mean[self._turns]
        self._mean[self._turns] = bounded
        self._mean[d + self._turns[is_beyond]] = 0.0

    def _re_reference(self) -> None:
        """Move the root's rotation vector into the reference before it leaves its chart."""
        vector = self.dof[3:6].copy()
        if np.linalg.norm(vector) < RE_REFERENCE_ANGLE:
            return
        d = self._size
        turn = Rotation.from_rotvec(vector).as_matrix()
        self.kinematics.R_reference = turn @ self.kinematics.R_reference
        change = np.eye(2 * d)
        change[3:6, 3:6] = change[d + 3 : d + 6, d + 3 : d + 6] = left_jacobian(vector)
        self._mean = change @ self._mean
        self._mean[3:6] = 0.0
        covariance = change @ self._covariance @ change.T
        self._covariance = 0.5 * (covariance + covariance.T)
