"""Interface of the estimators, live and offline."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import ClassVar

from pose_core.arrays import FloatArray
from pose_core.body.model import BodyModel
from pose_core.body.shape import BodyShape
from pose_core.counters import Counters
from pose_core.errors import ParameterError
from pose_core.estimates.observation import Observation
from pose_core.estimates.poses import EstimatedPose, TimedPose
from pose_core.estimators.parameters import PipelineParameters
from pose_core.estimators.uncertainty import FILTERED, VarianceCalibrations
from pose_core.imu.imu_history import ImuMeasurements
from pose_core.imu.imu_use import ImuUse
from pose_core.imu.sensor_to_segment import SensorsToSegments
from pose_core.kernels.published_state import PublishedState

RESTART_AFTER_S = 0.5  # [s] gap after which filters of stepwise estimators restart


class Estimator(ABC):
    """Estimates one person's pose from a sequence of observations.

    Args:
        model: The body model.
        shape: The person's body measures.
        parameters: The user's settings.
        counters: Counts rejected data by reason; see :attr:`COUNTERS`.
    """

    COUNTERS: ClassVar[tuple[str, ...]] = ()
    """Names of its counters."""
    BODY_MODEL: ClassVar[str] = "li2020"
    """The body model that it was designed for."""
    NEEDS_ALIGNED_FRAMES: ClassVar[bool] = True
    """Whether it needs all sensors interpolated to common instants."""
    NEEDS_FUTURE: ClassVar[bool] = False
    """Whether it uses later samples, which is possible only for recordings."""
    CAN_PREDICT: ClassVar[bool] = False
    """Whether :meth:`predicted` can predict the pose to instants without observation."""
    VARIANCE_CALIBRATION: ClassVar[VarianceCalibrations] = FILTERED
    """Calibration of the variances, if its poses are filter states."""
    USES_IMUS: ClassVar[bool] = False
    """Whether it uses IMU samples."""
    ALIGNS_IMUS: ClassVar[bool] = False
    """Whether it estimates sensor-to-segment alignments, which another pass can begin with."""

    def __init__(
        self, model: BodyModel, shape: BodyShape, parameters: PipelineParameters, counters: Counters
    ) -> None:
        self.model = model
        self.shape = shape
        self.parameters = parameters
        self.counters = counters

    @classmethod
    def check(cls, parameters: PipelineParameters) -> None:
        """Raise :class:`pose_core.errors.ParameterError` for parameters that it cannot use."""
        if parameters.tuning:
            raise ParameterError(
                f"tuning is of the default filter, not of estimator = {parameters.estimator}: "
                "leave one of them out"
            )

    @classmethod
    def maker(cls, parameters: PipelineParameters) -> Callable[..., "Estimator"]:
        """What makes a pipeline's estimators, one for each body shape; files are read here.

        Raises:
            ParameterError: For parameters that it cannot use.
        """
        cls.check(parameters)
        return cls

    @abstractmethod
    def track(self, observation: Observation) -> list[TimedPose]:
        """Process an observation; return the poses that can be published now."""

    def advance(self, observation: Observation) -> None:
        """Process an observation whose pose is not published."""
        self.track(observation)

    @property
    def imu_uses(self) -> tuple[ImuUse, ...]:
        """State of use of each IMU with samples; empty if the estimator uses none."""
        return ()

    @property
    def z_down_imus(self) -> frozenset[str]:
        """Segments whose IMU's reference frame has a z axis that points down (NED)."""
        return frozenset()

    @property
    def tracker_delays_s(self) -> FloatArray | None:
        """Delay of each sensor's tracker, (sensors,) [s], to subtract from its stamps."""
        return None

    @property
    def measured_delays_s(self) -> FloatArray | None:
        """Measured delay of each tracker and its deviation, (2, sensors) [s]; None if unknown."""
        return None

    @property
    def views_apart_m(self) -> FloatArray | None:
        """Distance of each camera's view from the estimate, (sensors,) [m]; None if unknown."""
        return None

    @property
    def sensor_to_segment(self) -> SensorsToSegments:
        """Sensor-to-segment rotations of the aligned IMUs; empty if the estimator uses none."""
        return {}

    def use_sensor_to_segment(self, alignments: SensorsToSegments) -> None:
        """Use sensor-to-segment rotations of a calibration; ignored by most estimators."""
        del alignments

    def predicted(self, stamp_ns: int, imus: ImuMeasurements) -> TimedPose | None:
        """Predict the pose to a later instant without changing the estimator; None if unknown.

        Args:
            stamp_ns: The instant [ns].
            imus: Samples of the IMUs at that instant, extrapolated by their gyroscopes.
        """
        del stamp_ns, imus
        return None

    @property
    def stamp_ns(self) -> int | None:
        """Instant of the last observation [ns]; None if there is no pose to predict."""
        return None

    def interpolated(self, stamps_ns: Sequence[int]) -> PublishedState | None:
        """States at n instants [ns] between the last two observations; None if unknown."""
        del stamps_ns
        return None

    def flush(self) -> list[TimedPose]:
        """The remaining poses, after the end of the streams."""
        return []


class StepwiseEstimator(Estimator):
    """An estimator with at most one pose for each observation."""

    @abstractmethod
    def update(self, observation: Observation) -> EstimatedPose | None:
        """Process an observation; return the pose at its instant, or None."""

    def track(self, observation: Observation) -> list[TimedPose]:
        """Process an observation; return its pose in a list, empty if there is none."""
        pose = self.update(observation)
        return [] if pose is None else [TimedPose(stamp_ns=observation.stamp_ns, pose=pose)]
