"""Extrinsics: poses of the sensors (li2020 (1)), with the floor and body measures found with them.

``T_reference_sensor`` maps a sensor's points into the frame of the reference, which is the first
sensor; ``T_map_reference`` maps those into ``map``.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.body.shape import BodyShape
from pose_core.errors import InputError
from pose_core.streams.clocks import Clock
from pose_core.transforms import inverse

TRACKER_OFFSET_M = 0.015  # [m] of joints, which looks like a scale where people hardly move
ROUGH_M = 0.08  # [m] median distance of two views of trackers that guess distances: 0.09 to 0.19
LASTING_SHARE = 0.4  # [-] of that distance that turns the view, in 13 sessions of MediaPipe
LASTING_POSITION_M = 0.02  # [m] by trackers' errors that more motion does not reduce
LITTLE_MOTION = 0.0262  # [rad] 1.5°: rotation noise from which more motion is asked for
SAME_SCALE = 0.02  # [-] relative difference; of trackers with the right scale at most 0.011


@dataclass(frozen=True, kw_only=True)
class PairResiduals:
    """Agreement of one sensor with another, over joints tracked by both."""

    partner: str  # the other sensor: the reference, or one with more common view
    frames: int  # [-] in which both saw the person
    raw_median: float  # [m] distance of a joint in the two views before calibration
    raw_rms: float  # [m]
    median: float  # [m] the same after it
    rms: float  # [m] all joints, outliers too
    inlier_rms: float  # [m] without the outliers
    inlier_share: Mapping[str, float]  # [-] by joint; joints never tracked in both are left out
    rotation_noise: float  # [rad] error about the least certain axis, which more motion reduces
    position_noise: float  # [m] along the least certain axis
    distance: float  # [m] of the person from the sensor, median
    spread: tuple[float, float, float]  # [m] of the points along their principal axes, RMS
    scale: float = 1.0  # [-] of its joints, relative to the partner's

    @property
    def scale_differs(self) -> bool:
        """Whether one of the two trackers has a wrong scale."""
        difference, size = abs(self.scale - 1.0), float(np.linalg.norm(self.spread))
        return difference > SAME_SCALE and difference * size > TRACKER_OFFSET_M

    @property
    def is_rough(self) -> bool:
        """Whether the views differ more than those of depth cameras: errors do not average out."""
        return self.median > ROUGH_M

    @property
    def needs_motion(self) -> bool:
        """Whether the person moved so little that the rotation is uncertain."""
        return self.rotation_noise > LITTLE_MOTION

    @property
    def rotation_stddev(self) -> float:
        """Standard deviation about the least certain axis [rad]."""
        return float(np.hypot(self.rotation_noise, self._lasting_rotation))

    @property
    def position_stddev(self) -> float:
        """Standard deviation along the least certain axis [m]."""
        # One of two views with another scale is displaced along its line of sight.
        displaced = abs(self.scale - 1.0) * self.distance if self.scale_differs else 0.0
        turned = self._lasting_rotation * self.distance
        noise = [self.position_noise, displaced, turned, LASTING_POSITION_M]
        return float(np.linalg.norm(noise))

    @property
    def _lasting_rotation(self) -> float:
        """Error of a rough view's rotation that more motion does not reduce [rad]."""
        return LASTING_SHARE * self.median / float(np.linalg.norm(self.spread)) * self.is_rough

    @property
    def all_inlier_share(self) -> float:
        """Share of inliers [-], mean over the joints."""
        return float(np.mean(list(self.inlier_share.values())))


@dataclass(frozen=True, kw_only=True)
class BoardResiduals:
    """Accuracy of one sensor's pose from a board."""

    views: int  # [-] instants at which it and another sensor saw the board
    reprojection_px: float  # [px] RMS over all corners
    rotation_stddev: float  # [rad] about the least certain axis
    position_stddev: float  # [m] along the least certain axis


@dataclass(frozen=True, kw_only=True)
class FloorEstimate:
    """Pose of the reference sensor relative to the floor."""

    T_map_reference: FloatArray  # (4, 4)
    source: str  # source of the vertical
    up_stddev: float  # [rad]
    height_stddev: float  # [m]

    @property
    def height(self) -> float:
        """Height of the reference sensor above the floor [m]."""
        return float(self.T_map_reference[2, 3])

    @property
    def tilt(self) -> float:
        """Downward tilt [rad] of the reference sensor's viewing direction."""
        return float(-np.arcsin(np.clip(self.T_map_reference[2, 2], -1.0, 1.0)))


@dataclass(frozen=True, kw_only=True)
class SessionBody:
    """A person's body measures, and the body model that they refer to."""

    model: str
    shape: BodyShape


@dataclass(frozen=True, kw_only=True)
class Extrinsics:
    """Pose of each sensor."""

    reference: str  # the first sensor
    T_reference_sensor: Mapping[str, FloatArray]  # (4, 4) by sensor, the reference's an identity
    T_map_reference: FloatArray  # (4, 4)
    residuals: Mapping[str, PairResiduals] = field(default_factory=dict)  # without the reference
    board: Mapping[str, BoardResiduals] = field(default_factory=dict)  # the same, of a board
    floor: FloorEstimate | None = None  # how T_map_reference was found
    clocks: Mapping[str, Clock] = field(default_factory=dict)  # by source, those that differ
    body: SessionBody | None = None  # the person's body measures, if they were measured
    view_offsets: Mapping[str, FloatArray] = field(default_factory=dict)
    """Measured minus true joint positions of each sensor's tracker, (15, 3) [m] by sensor, in axes
    that rotate with the body (x forward, y left, z up)."""

    @property
    def sensors(self) -> tuple[str, ...]:
        """All sensors, the reference first."""
        return tuple(self.T_reference_sensor)

    @property
    def rough_m(self) -> float:
        """Largest median distance [m] of a joint in two views, if they are rough; 0 otherwise."""
        return max((pair.median for pair in self.residuals.values() if pair.is_rough), default=0.0)

    def T_map_sensor(self, sensor: str) -> FloatArray:  # noqa: N802 (the name of a matrix)
        """The transform from a sensor's frame to ``map``, shape (4, 4)."""
        return self.T_map_reference @ self.T_reference_sensor[sensor]


def extrinsics_from_map(T_map_sensor: Mapping[str, FloatArray]) -> Extrinsics:
    """Extrinsics from each sensor's pose in ``map``, (4, 4) by sensor, the reference first.

    Raises:
        InputError: If there is no sensor.
    """
    if not T_map_sensor:
        raise InputError("there is no camera")
    reference = next(iter(T_map_sensor))
    T_reference_map = inverse(T_map_sensor[reference])
    return Extrinsics(
        reference=reference,
        T_reference_sensor={
            name: np.eye(4) if name == reference else T_reference_map @ T
            for name, T in T_map_sensor.items()
        },
        T_map_reference=T_map_sensor[reference],
    )
