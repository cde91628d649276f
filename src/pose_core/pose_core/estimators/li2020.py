"""``li2020``: the filter of the paper, which uses only cameras; restarted when it is lost."""

from importlib.util import find_spec
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from pose_core.arrays import FloatArray
from pose_core.baseline_filters.li2020 import Li2020Filter
from pose_core.body.joint_rotations import continuous_vector
from pose_core.errors import ParameterError
from pose_core.estimates.observation import Observation
from pose_core.estimates.poses import FusedPose, pose_by_cameras
from pose_core.estimators.estimator import RESTART_AFTER_S, StepwiseEstimator
from pose_core.estimators.parameters import PipelineParameters
from pose_core.filter.restart_cause import RestartCause
from pose_core.finite_numbers import nan_mean
from pose_core.joints import JOINT_INDEX, TrackingState
from pose_core.stamps import NS_PER_S

DIVERGED_NS = NS_PER_S // 2
RESTART_DISTANCE_M = 0.3  # [m] of the median joint from its prediction, for that long


class Li2020Estimator(StepwiseEstimator):
    """The unscented Kalman filter over the degrees of freedom of the kinematic tree."""

    COUNTERS = (
        "frames_without_trunk",
        "filter_starts",
        RestartCause.GAP.value,
        RestartCause.TIME_JUMP.value,
        RestartCause.DIVERGED.value,
        RestartCause.NUMERICAL.value,
    )

    def __init__(self, *arguments: Any, **named: Any) -> None:
        super().__init__(*arguments, **named)
        self._filter = Li2020Filter(self.model, self.shape)
        self._last_ns: int | None = None
        self._diverged_since_ns: int | None = None
        self._root_vector: FloatArray | None = None

    @classmethod
    def check(cls, parameters: PipelineParameters) -> None:
        """Check that the library with the sigma points' weights is installed."""
        super().check(parameters)
        if find_spec("filterpy") is None:
            raise ParameterError(
                "estimator = li2020 needs the library filterpy, which is not installed: "
                "pip install 'pose_core[li2020]'"
            )

    def update(self, observation: Observation) -> FusedPose | None:
        """Run one filter step."""
        if not self._track(observation.stamp_ns, observation.positions):
            return None
        return self._pose(observation.tracking_state.max(axis=0))

    def _track(self, stamp_ns: int, measured: FloatArray) -> bool:
        """Update the filter with the measurements of one instant.

        Args:
            stamp_ns: The instant.
            measured: Joints of each sensor in map, shape (sensors, 15, 3) [m]; NaN if unseen.

        Returns:
            Whether the filter has a pose.
        """
        if self._last_ns is None:
            return self._start(stamp_ns, measured)
        dt_ns = stamp_ns - self._last_ns
        if not 0 < dt_ns <= RESTART_AFTER_S * NS_PER_S:
            cause = RestartCause.GAP if dt_ns > 0 else RestartCause.TIME_JUMP
            return self._start(stamp_ns, measured, cause)
        try:
            innovation = self._filter.step(dt_ns / NS_PER_S, measured)
        except np.linalg.LinAlgError:
            return self._start(stamp_ns, measured, RestartCause.NUMERICAL)
        self._last_ns = stamp_ns
        if self._has_diverged(stamp_ns, innovation):
            return self._start(stamp_ns, measured, RestartCause.DIVERGED)
        return True

    def _start(
        self, stamp_ns: int, measured: FloatArray, cause: RestartCause | None = None
    ) -> bool:
        """Start the filter, with a cause if it restarts; False without the trunk."""
        if cause:
            self.counters.add(cause.value)
        self._last_ns = self._diverged_since_ns = self._root_vector = None
        if not self._filter.start(nan_mean(measured)):
            self.counters.add("frames_without_trunk")
            return False
        self.counters.add("filter_starts")
        self._last_ns = stamp_ns
        return True

    def _has_diverged(self, stamp_ns: int, innovation: FloatArray) -> bool:
        """Whether the filter has lost the person for too long."""
        seen = innovation[np.isfinite(innovation)]
        if len(seen) == 0 or np.median(seen) < RESTART_DISTANCE_M:
            self._diverged_since_ns = None
            return False
        if self._diverged_since_ns is None:
            self._diverged_since_ns = stamp_ns
        return stamp_ns - self._diverged_since_ns >= DIVERGED_NS

    def _pose(self, tracking_state: NDArray[np.uint8]) -> FusedPose:
        """The filter's state as a pose.

        Args:
            tracking_state: Best state of each joint over the sensors, shape (15,).
        """
        model, filtered = self.model, self._filter
        placed = filtered.kinematics.pose(filtered.dof)
        position = filtered.dof.copy()
        position[3:6] = Rotation.from_matrix(placed.rotations[0]).as_rotvec()
        if self._root_vector is not None:
            position[3:6] = continuous_vector(position[3:6], self._root_vector)
        self._root_vector = position[3:6].copy()
        seen = np.full(model.size, np.any(tracking_state > TrackingState.NOT_TRACKED))
        for name, link_name in model.link_of_dof.items():
            end = JOINT_INDEX[model.ends(link_name)[1]]
            seen[model.dof_index[name]] &= tracking_state[end] > TrackingState.NOT_TRACKED
        variance = np.diag(filtered.covariance)
        return pose_by_cameras(position, filtered.rates, variance, seen, placed, tracking_state)
