"""``dof_kf``: ablation of li2020: degrees of freedom first, then a linear Kalman filter.

It demonstrates a bias: each sensor's degrees of freedom are a nonlinear function of noisy
positions, so their mean is shifted, which a subsequent linear filter cannot correct.
"""

import numpy as np
from numpy.typing import NDArray

from pose_core.arrays import FloatArray
from pose_core.baseline_filters.constant_velocity import FRAME_PERIOD_S, ConstantVelocityFilter
from pose_core.body.inverse_kinematics import dof_in_map
from pose_core.body.joint_rotations import continuous_dof
from pose_core.body.kinematics import ForwardKinematics
from pose_core.body.model import ROOT_DOF
from pose_core.estimates.observation import Observation
from pose_core.estimates.poses import FusedPose, pose_by_cameras
from pose_core.estimators.estimator import RESTART_AFTER_S, StepwiseEstimator
from pose_core.stamps import NS_PER_S

ROOT_ACCELERATION = 10.0  # [m/s²] white, over a frame
ANGULAR_ACCELERATION = 80.0  # [rad/s²] likewise
ROOT_STDDEV = 0.02  # [m] of a sensor's root position
ANGLE_STDDEV = 0.1  # [rad] of an angle that a sensor's positions give


class DofKalmanFilter(StepwiseEstimator):
    """Independent filters for all degrees of freedom."""

    COUNTERS = ("filter_starts",)

    _filter: ConstantVelocityFilter | None = None
    _stamp_ns = 0

    def update(self, observation: Observation) -> FusedPose | None:
        """Predict to the instant and update with each sensor's degrees of freedom in turn."""
        gap_s = (observation.stamp_ns - self._stamp_ns) / NS_PER_S
        is_new = self._filter is None or not 0.0 < gap_s <= RESTART_AFTER_S
        previous = np.zeros(self.model.size)
        if not is_new and self._filter is not None:
            self._filter.predict(gap_s)
            previous = self._filter.mean[:, 0]
        seen = [self._read(positions, previous) for positions in observation.positions]
        if is_new and not self._start([each for each in seen if np.isfinite(each[:6]).all()]):
            return None
        self._stamp_ns = observation.stamp_ns
        assert self._filter is not None
        for each in seen:
            self._filter.update(each, self._variance)
        is_seen = any(np.isfinite(each[:6]).all() for each in seen)
        return self._describe(is_seen, observation.tracking_state.max(axis=0))

    def _start(self, seen: list[FloatArray]) -> bool:
        if not seen:
            return False
        self.counters.add("filter_starts")
        size = self.model.size
        root = np.arange(size) < 3
        acceleration = np.where(root, ROOT_ACCELERATION, ANGULAR_ACCELERATION)
        self._variance = np.where(root, ROOT_STDDEV, ANGLE_STDDEV) ** 2
        self._kinematics = ForwardKinematics(self.model, self.shape.offsets)
        start = np.where(np.isfinite(seen[0]), seen[0], 0.0)
        self._filter = ConstantVelocityFilter(
            start, ANGLE_STDDEV, 1.0, acceleration**2 * FRAME_PERIOD_S
        )
        return True

    def _read(self, positions: FloatArray, previous: FloatArray) -> FloatArray:
        """One sensor's degrees of freedom, continuous with the previous ones; NaN without trunk."""
        dof = dof_in_map(self.model, positions)
        is_seen = np.isfinite(dof[:ROOT_DOF]).all()
        return continuous_dof(dof, previous) if is_seen else np.full_like(dof, np.nan)

    def _describe(self, is_seen: bool, tracking_state: NDArray[np.uint8]) -> FusedPose:
        assert self._filter is not None
        position, velocity = self._filter.mean.T
        variance = self._filter.covariance[:, 0, 0]
        pose = self._kinematics.pose(position)
        return pose_by_cameras(position, velocity, variance, is_seen, pose, tracking_state)
