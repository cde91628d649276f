"""What every estimator takes and gives, live and offline alike."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar, TypeAlias

import numpy as np
from numpy.typing import NDArray

from pose_common.counters import Counters
from pose_fusion.body.model import BodyModel
from pose_fusion.body.shape import BodyShape
from pose_fusion.fusion.estimators.uncertainty import LIVE, Trusts
from pose_fusion.fusion.parameters import FusionParameters
from pose_fusion.imu.readings import SegmentReadings
from pose_fusion.kernels.reading import StateNumbers
from pose_fusion.streams.samples import FloatArray


@dataclass(frozen=True, kw_only=True)
class Observation:
    """What the sensors say of one instant, in ``map``, and of whom."""

    stamp_ns: int  # [ns]
    newest_ns: int  # [ns] stamp of the newest sample of any source that had come by then
    shape: BodyShape  # the person's measures; another object is another body
    positions: FloatArray  # (sensors, 15, 3) [m]; NaN where a sensor says nothing
    tracking_state: NDArray[np.uint8]  # (sensors, 15), values of TrackingState
    cameras: FloatArray  # (sensors, 3) [m] where the sensors stand; NaN not placed
    offsets: FloatArray  # (sensors, 15, 3) [m] of each tracker's joints, in heading axes
    readings: SegmentReadings  # of the aligned IMUs


@dataclass(kw_only=True)
class FusedPose:
    """A pose in the model's degrees of freedom, with provenance; arrays over d of them."""

    position: FloatArray  # [m], [rad]; the root's rotation is the vector of R_map_body
    velocity: FloatArray
    variance: FloatArray  # NaN: not known
    weight_kinect: FloatArray
    weight_imu: FloatArray
    source: NDArray[np.uint8]
    rotations: FloatArray  # (links, 3, 3): R_map_link
    joints: FloatArray  # (15, 3) [m] in map
    sensor_weight: FloatArray  # (sensors, 15): each sensor's share in each joint


EstimatedPose: TypeAlias = FusedPose | StateNumbers
"""A pose that is told as it is, or a filter's state, of which it is still to be read."""


@dataclass(frozen=True, kw_only=True)
class TimedPose:
    """A pose and when it was."""

    stamp_ns: int  # [ns]
    tracking_state: NDArray[np.uint8]  # (sensors, 15)
    pose: EstimatedPose


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
        """Raise :class:`pose_common.errors.ParameterError` for what cannot work."""
        del parameters  # most take any

    @abstractmethod
    def update(self, observation: Observation) -> EstimatedPose | None:
        """The pose at an observation's instant; None while there is none."""

    def advance(self, observation: Observation) -> list[TimedPose]:
        """The poses that an observation completes: its own, unless the estimator looks ahead."""
        pose = self.update(observation)
        return [] if pose is None else [timed(pose, observation)]

    def predicted(self, stamp_ns: int, readings: SegmentReadings) -> TimedPose | None:
        """The pose at a later instant, as far as it is known; leaves everything as it is.

        Args:
            stamp_ns: The instant [ns].
            readings: Of the aligned IMUs at that instant, carried on by their gyroscopes.
        """
        del stamp_ns, readings
        return None

    def flush(self) -> list[TimedPose]:
        """What is left to be told when nothing comes any more."""
        return []


def timed(pose: EstimatedPose, observation: Observation) -> TimedPose:
    """A pose of an observation's instant."""
    return TimedPose(
        stamp_ns=observation.stamp_ns, tracking_state=observation.tracking_state, pose=pose
    )
