"""The filter of li2020 with filterpy: Python functions ``fx`` and ``hx``, one point at a time.

Sigma points, unscented transform and cross covariance are filterpy's.
"""

import numpy as np
from filterpy.common import Q_discrete_white_noise
from filterpy.kalman import MerweScaledSigmaPoints, UnscentedKalmanFilter, unscented_transform

from pose_core.api import ROOT_DOF, BodyModel, BodyShape
from pose_core.arrays import FloatArray
from pose_core.baseline_filters.li2020 import (
    ALPHA,
    ANGULAR_ACCELERATION,
    FRAME_PERIOD_S,
    ROOT_ACCELERATION,
)
from pose_core.baseline_filters.measurement_noise import fuse_measurements, measurement_noise
from pose_core.joints import JOINT_INDEX, JOINTS


def rodrigues(vector: FloatArray) -> FloatArray:
    """The rotation matrix of a rotation vector [rad], shape (3,) to (3, 3)."""
    angle = np.linalg.norm(vector)
    if angle == 0.0:
        return np.eye(3)
    x, y, z = vector / angle
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * K + (1.0 - np.cos(angle)) * K @ K


class TextbookFilter:
    """One person's degrees of freedom and rates, without restarts and bounds of li2020's filter.

    Args:
        model: The body model.
        shape: The person's body measures.
        R_reference: Rotation of the root's zero rotation vector.
    """

    def __init__(self, model: BodyModel, shape: BodyShape, R_reference: FloatArray) -> None:
        self._model, self._shape, self._R_reference = model, shape, R_reference
        size = 2 * model.size
        self.ukf = UnscentedKalmanFilter(
            size,
            3 * len(JOINTS),
            FRAME_PERIOD_S,
            self.hx,
            self.fx,
            MerweScaledSigmaPoints(size, ALPHA, 2.0, 0.0),
        )
        acceleration = np.full(model.size, ANGULAR_ACCELERATION)
        acceleration[:3] = ROOT_ACCELERATION
        block = Q_discrete_white_noise(dim=2, dt=FRAME_PERIOD_S, var=1.0)
        self.ukf.Q = np.kron(block, np.diag(acceleration**2))

    def fx(self, x: FloatArray, dt: float) -> FloatArray:
        """The state after ``dt`` [s]: li2020 (11)."""
        d = self._model.size
        moved = x.copy()
        moved[:d] += dt * x[d:]
        return moved

    def hx(self, x: FloatArray) -> FloatArray:
        """The joints of a state, shape (45,) [m]."""
        rotations: dict[str, FloatArray] = {}
        joints = np.zeros((len(JOINTS), 3))
        for link in self._model.links.values():
            if link.parent is None or link.joint is None:
                R, origin = rodrigues(x[3:ROOT_DOF]) @ self._R_reference, x[:3]
            else:
                R, origin = rotations[link.parent], joints[JOINT_INDEX[link.joint]]
            for dof in link.dof:
                R = R @ rodrigues(np.array(dof.axis) * x[self._model.dof_index[dof.name]])
            rotations[link.name] = R
            for name, place in self._model.joints.items():
                if place.link == link.name:
                    joints[JOINT_INDEX[name]] = origin + R @ self._shape.offsets[JOINT_INDEX[name]]
        return joints.ravel()

    def step(self, dt_s: float, measured: FloatArray) -> None:
        """Predict by ``dt_s`` [s], update with every sensor's joints, (sensors, 15, 3) [m]."""
        ukf = self.ukf
        ukf.compute_process_sigmas(dt_s, self.fx)
        ukf.x, ukf.P = unscented_transform(ukf.sigmas_f, ukf.Wm, ukf.Wc, ukf.Q)
        # filterpy would draw new points here; li2020 uses the propagated ones.
        sigmas_h = np.array([self.hx(point) for point in ukf.sigmas_f])
        zp, S = unscented_transform(sigmas_h, ukf.Wm, ukf.Wc)
        z = measured.reshape(len(measured), -1)
        fused, R = fuse_measurements(z, measurement_noise(z, zp, np.diag(S)), zp)
        S = S + np.diag(R)
        K = ukf.cross_variance(ukf.x, zp, ukf.sigmas_f, sigmas_h) @ np.linalg.inv(S)
        ukf.x = ukf.x + K @ (fused - zp)
        ukf.P = ukf.P - K @ S @ K.T
