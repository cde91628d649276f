"""``li2020``: the paper's filter, with zhang2015's weighting where IMUs are worn."""

from pose_core.body.model import BodyModel
from pose_core.body.shape import BodyShape
from pose_core.counters import Counters
from pose_core.estimators.body_fusion import BodyFusion
from pose_core.estimators.estimator import StepwiseEstimator
from pose_core.estimators.kinect_tracker import COUNTERS, KinectTracker
from pose_core.fusion.observation_block import Observation
from pose_core.fusion.parameters import FusionParameters
from pose_core.fusion.pose_block import FusedPose


class Li2020Estimator(StepwiseEstimator):
    """The unscented filter over the tree's degrees of freedom, then the IMUs by weight."""

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
        self._fusion = BodyFusion(
            model,
            parameters.kinect_joint_stddev,
            parameters.imu_mounting_stddev,
            parameters.imu_weighting == "zhang2015",
        )

    def update(self, observation: Observation) -> FusedPose | None:
        """One step of the filter."""
        starts = self.counters["filter_starts"]
        if not self._tracker.update(observation.stamp_ns, observation.positions):
            return None
        if self.counters["filter_starts"] > starts:
            self._fusion.reset()
        return self._fusion.fuse(
            self._tracker.filter,
            observation.tracking_state.max(axis=0),
            observation.readings,
            self._tracker.sensor_weight,
        )
