"""``joint_kf``: a linear Kalman filter for each joint position, over all sensors.

References:
    Moon, Park, Ko, Suh (2016), Multiple Kinect sensor fusion for human skeleton tracking using
    Kalman filtering, Int. J. Advanced Robotic Systems 13(2): constant velocity, one filter a joint,
    no tree.
"""

import numpy as np

from pose_core.baseline_filters.constant_velocity import FRAME_PERIOD_S, ConstantVelocityFilter
from pose_core.estimates.observation import Observation
from pose_core.estimates.poses import FusedPose
from pose_core.estimators.estimator import RESTART_AFTER_S, StepwiseEstimator
from pose_core.estimators.pose_of_joints import PoseOfJoints
from pose_core.finite_numbers import nan_mean
from pose_core.joints import JOINTS, TrackingState
from pose_core.stamps import NS_PER_S

ACCELERATION = 25.0  # [m/s²] white, over a frame; tuned on the motions for tuning
MEASUREMENT_STDDEV = 0.02  # [m] of a tracked joint
INFERRED_FACTOR = 3.0  # [-] of the standard deviation of an inferred joint


class JointKalmanFilter(StepwiseEstimator):
    """Independent filters for all coordinates of all joints."""

    COUNTERS = ("filter_starts",)

    _filter: ConstantVelocityFilter | None = None
    _stamp_ns = 0

    def update(self, observation: Observation) -> FusedPose | None:
        """Predict to the instant and update with each sensor's joints in turn."""
        gap_s = (observation.stamp_ns - self._stamp_ns) / NS_PER_S
        if self._filter is None or not 0.0 < gap_s <= RESTART_AFTER_S:
            if not self._start(observation):
                return None
        else:
            self._filter.predict(gap_s)
        self._stamp_ns = observation.stamp_ns
        assert self._filter is not None
        tracked = observation.tracking_state == TrackingState.TRACKED
        stddev = np.where(tracked, MEASUREMENT_STDDEV, INFERRED_FACTOR * MEASUREMENT_STDDEV)
        for positions, each in zip(observation.positions, stddev, strict=True):
            self._filter.update(positions.ravel(), np.repeat(each**2, 3))
        joints = self._filter.mean[:, 0].reshape(len(JOINTS), 3)
        return self._pose.at(observation.stamp_ns, joints, observation.tracking_state.max(axis=0))

    def _start(self, observation: Observation) -> bool:
        """Initialise from the mean of the sensors, once every joint has been measured."""
        mean = nan_mean(observation.positions)
        if not np.all(np.isfinite(mean)):
            return False
        self.counters.add("filter_starts")
        self._pose = PoseOfJoints(self.model, self.shape)
        self._filter = ConstantVelocityFilter(
            mean.ravel(), MEASUREMENT_STDDEV, 0.5, ACCELERATION**2 * FRAME_PERIOD_S
        )
        return True
