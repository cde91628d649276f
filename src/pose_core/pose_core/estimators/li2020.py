"""``li2020``: the paper's filter, with zhang2015's weighting where IMUs are worn."""

from collections.abc import Mapping
from importlib.util import find_spec

from pose_core.body.model import BodyModel
from pose_core.body.shape import BodyShape
from pose_core.counters import Counters
from pose_core.errors import ParameterError
from pose_core.estimators.body_fusion import BodyFusion
from pose_core.estimators.estimator import StepwiseEstimator
from pose_core.estimators.kinect_tracker import COUNTERS, KinectTracker
from pose_core.filter.imu_use import ImuUse
from pose_core.fusion.observation import Observation
from pose_core.fusion.parameters import FusionParameters
from pose_core.fusion.pose_block import FusedPose
from pose_core.imu.aligned_readings import AlignedReadings
from pose_core.imu.mounting import Mounting


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
        self._imus = AlignedReadings(model)
        self._fusion = BodyFusion(
            model,
            parameters.kinect_joint_stddev,
            parameters.imu_mounting_stddev,
            parameters.imu_weighting == "zhang2015",
        )

    @property
    def imu_uses(self) -> tuple[ImuUse, ...]:
        """What becomes of each IMU that was heard."""
        return self._imus.uses

    def use_mountings(self, mountings: Mapping[str, Mounting]) -> None:
        """Take how IMUs sit from a calibration."""
        self._imus.use_mountings(mountings)

    @classmethod
    def check(cls, parameters: FusionParameters) -> None:
        """The library that has the sigma points' weights must be installed."""
        del parameters
        if find_spec("filterpy") is None:
            raise ParameterError(
                "estimator = li2020 needs the library filterpy, which is not installed: "
                "pip install 'pose_core[li2020]'"
            )

    def update(self, observation: Observation) -> FusedPose | None:
        """One step of the filter."""
        starts = self.counters["filter_starts"]
        if not self._tracker.update(observation.stamp_ns, observation.positions):
            return None
        if self.counters["filter_starts"] > starts:
            self._fusion.reset()
        filtered = self._tracker.filter
        if len(observation.readings):
            links = filtered.kinematics.pose(filtered.dof).rotations
            self._imus.observe(observation.stamp_ns, observation.readings, links)
        return self._fusion.fuse(
            filtered,
            observation.tracking_state.max(axis=0),
            self._imus.read(observation.readings),
            self._tracker.sensor_weight,
        )
