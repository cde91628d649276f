"""What there is to show of one moment; the same for a live graph and for a recording."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from pose_core.api import FloatArray
from pose_view.robot import RobotSnapshot


@dataclass(frozen=True, kw_only=True)
class DofSnapshot:
    """The degrees of freedom of one body, as a ``PoseEstimate`` says them; arrays over d."""

    names: tuple[str, ...]
    position: FloatArray  # [m] or [rad]
    stddev: FloatArray  # [m] or [rad]
    weight_imu: FloatArray  # [-] 0..1
    source: NDArray[np.uint8]  # pose_fusion's Source
    latency_s: float  # [s] from the newest sample's capture to publication


@dataclass(frozen=True, kw_only=True)
class BodySnapshot:
    """One body."""

    stamp_ns: int
    joints: FloatArray  # (15, 3) [m] in map
    tracking_state: NDArray[np.uint8]  # (15,) best of the sensors
    dof: DofSnapshot | None = None
    rotations: Mapping[str, FloatArray] = field(default_factory=dict)
    """R_map_link (3, 3) by the link's name, where they are known."""


@dataclass(frozen=True, kw_only=True)
class RawSkeleton:
    """What one sensor saw of one person."""

    stamp_ns: int
    person: str
    joints: FloatArray  # (15, 3) [m] in the sensor's frame, NaN where not tracked


@dataclass(frozen=True, kw_only=True)
class Snapshot:
    """All that is to be drawn."""

    bodies: Mapping[str, BodySnapshot] = field(default_factory=dict)
    """By the body's id."""
    sensors: Mapping[str, FloatArray] = field(default_factory=dict)
    """T_map_sensor (4, 4) by the sensor's name."""
    raw: Mapping[str, tuple[RawSkeleton, ...]] = field(default_factory=dict)
    """Everybody that each sensor sees, by the sensor's name."""
    imus: tuple[str, ...] = ()
    """Segments that carry an IMU which is aligned."""
    robot: RobotSnapshot | None = None
    """The robot that follows, if there is one."""
