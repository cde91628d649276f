"""What every estimator takes and gives, live and offline alike."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import ClassVar

from pose_core.body.model import BodyModel
from pose_core.body.shape import BodyShape
from pose_core.counters import Counters
from pose_core.estimators.uncertainty import LIVE, Trusts
from pose_core.filter.imu_use import ImuUse
from pose_core.fusion.observation import Observation
from pose_core.fusion.parameters import FusionParameters
from pose_core.fusion.pose_block import EstimatedPose, PoseBlock, TimedPose, block_of_poses, timed
from pose_core.imu.imu_history import ImuStates
from pose_core.imu.sensor_to_segment import SensorsToSegments
from pose_core.streams.samples import FloatArray


class Estimator(ABC):
    """One person's pose from observation to observation.

    Args:
        model: The body model.
        shape: The person's measures.
        parameters: What the user may set.
        counters: Counts by reason what was not used; see :attr:`COUNTERS`.
    """

    COUNTERS: ClassVar[tuple[str, ...]] = ()
    """Names that it counts under."""
    BODY_MODEL: ClassVar[str] = "li2020"
    """The body model that it was made for."""
    NEEDS_ALIGNED_FRAMES: ClassVar[bool] = True
    """Whether it wants all sensors interpolated to common instants, or each as it comes."""
    NEEDS_FUTURE: ClassVar[bool] = False
    """Whether it looks ahead, which only a recording allows."""
    CAN_PREDICT: ClassVar[bool] = False
    """Whether :meth:`predicted` tells the pose at instants that nothing was seen at."""
    TRUSTS: ClassVar[Trusts] = LIVE
    """What the variances of its states are worth, where its poses are states."""
    USES_IMUS: ClassVar[bool] = False
    """Whether it takes IMUs' readings."""

    def __init__(
        self,
        model: BodyModel,
        shape: BodyShape,
        parameters: FusionParameters,
        counters: Counters,
    ) -> None:
        self.model = model
        self.shape = shape
        self.parameters = parameters
        self.counters = counters

    @classmethod
    def check(cls, parameters: FusionParameters) -> None:
        """Raise :class:`pose_core.errors.ParameterError` for what cannot work."""
        del parameters  # most take any

    @abstractmethod
    def track(self, observation: Observation) -> list[TimedPose]:
        """The poses that an observation completes."""

    @property
    def imu_uses(self) -> tuple[ImuUse, ...]:
        """What becomes of each IMU that was heard; empty where none are used."""
        return ()

    @property
    def tracker_delays_s(self) -> FloatArray | None:
        """Delay of each sensor's tracker, (sensors,) [s], by which its stamps are taken back."""
        return None

    @property
    def sensor_to_segment(self) -> SensorsToSegments:
        """How the IMUs sit that are aligned now; empty where none are used."""
        return {}

    def use_sensor_to_segment(self, alignments: SensorsToSegments) -> None:
        """Take how IMUs sit from a calibration; most estimators use none."""
        del alignments

    def predicted(self, stamp_ns: int, readings: ImuStates) -> TimedPose | None:
        """The pose at a later instant, as far as it is known; leaves everything as it is.

        Args:
            stamp_ns: The instant [ns].
            readings: Of the IMUs at that instant, carried on by their gyroscopes.
        """
        del stamp_ns, readings
        return None

    def block_of(self, poses: Sequence[TimedPose], newest_ns: Sequence[int]) -> PoseBlock:
        """Poses as a block, see :func:`pose_core.fusion.pose_block.block_of_poses`."""
        return block_of_poses(poses, newest_ns, self.model, self.parameters.sensors)

    def flush(self) -> list[TimedPose]:
        """What is left to be told when nothing comes any more."""
        return []


class StepwiseEstimator(Estimator):
    """One that takes an observation at a time, and has a pose for it or none."""

    @abstractmethod
    def update(self, observation: Observation) -> EstimatedPose | None:
        """The pose at an observation's instant; None while there is none."""

    def track(self, observation: Observation) -> list[TimedPose]:
        """The pose at an observation's instant, if there is one."""
        pose = self.update(observation)
        return [] if pose is None else [timed(pose, observation)]
