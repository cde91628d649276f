"""``li2020``: the filter of the paper, which uses only cameras."""

from importlib.util import find_spec

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from pose_core.arrays import FloatArray
from pose_core.body.joint_rotations import continuous_vector
from pose_core.body.model import BodyModel
from pose_core.body.shape import BodyShape
from pose_core.counters import Counters
from pose_core.errors import ParameterError
from pose_core.estimates.body_estimates import Source
from pose_core.estimates.observation import Observation
from pose_core.estimates.poses import FusedPose
from pose_core.estimators.estimator import StepwiseEstimator
from pose_core.estimators.kinect_tracker import COUNTERS, KinectTracker
from pose_core.estimators.parameters import FusionParameters
from pose_core.joints import JOINT_INDEX, TrackingState


class Li2020Estimator(StepwiseEstimator):
    """The unscented Kalman filter over the degrees of freedom of the kinematic tree."""

    COUNTERS = COUNTERS

    def __init__(
        self,
        model: BodyModel,
        shape: BodyShape,
        parameters: FusionParameters,
        counters: Counters,
    ) -> None:
        super().__init__(model, shape, parameters, counters)
        self._tracker = KinectTracker(model, shape, parameters, counters)
        self._root_vector: FloatArray | None = None

    @classmethod
    def check(cls, parameters: FusionParameters) -> None:
        """Check that the library with the sigma points' weights is installed."""
        del parameters
        if find_spec("filterpy") is None:
            raise ParameterError(
                "estimator = li2020 needs the library filterpy, which is not installed: "
                "pip install 'pose_core[li2020]'"
            )

    def update(self, observation: Observation) -> FusedPose | None:
        """Run one filter step."""
        starts = self.counters["filter_starts"]
        if not self._tracker.update(observation.stamp_ns, observation.positions):
            return None
        if self.counters["filter_starts"] > starts:
            self._root_vector = None
        return self._pose(observation.tracking_state.max(axis=0))

    def _pose(self, tracking_state: NDArray[np.uint8]) -> FusedPose:
        """The filter's state as a pose.

        Args:
            tracking_state: Best state of each joint over the sensors, shape (15,).
        """
        model, filtered = self.model, self._tracker.filter
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
        return FusedPose(
            position=position,
            velocity=filtered.rates.copy(),
            variance=np.diag(filtered.covariance).copy(),
            weight_kinect=seen.astype(float),
            weight_imu=np.zeros(model.size),
            source=np.where(seen, Source.KINECT, Source.PREDICTED).astype(np.uint8),
            rotations=placed.rotations,
            joints=placed.positions,
            tracking_state=tracking_state,
        )
