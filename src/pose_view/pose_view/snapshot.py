"""Data to draw at one instant, of a live graph or of a recording."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from pose_core.api import FloatArray, SkeletonSample
from pose_io.arrays import ByteArray
from pose_view.robot import RobotSnapshot


@dataclass(frozen=True, kw_only=True)
class DofSnapshot:
    """The degrees of freedom of one body, as in a ``PoseEstimate``; arrays over d."""

    names: tuple[str, ...]
    position: FloatArray  # [m] or [rad]
    stddev: FloatArray  # [m] or [rad]
    weight_imu: FloatArray  # [-] 0..1
    source: ByteArray  # pose_fusion's Source
    latency_s: float  # [s] from the newest sample's capture to publication


@dataclass(frozen=True, kw_only=True)
class BodySnapshot:
    """Pose of one body."""

    stamp_ns: int
    joints: FloatArray  # (15, 3) [m] in map
    tracking_state: ByteArray  # (15,) best of the sensors
    dof: DofSnapshot | None = None
    rotations: Mapping[str, FloatArray] = field(default_factory=dict)
    """R_map_link (3, 3) by the link's name, where they are known."""


@dataclass(frozen=True, kw_only=True)
class Snapshot:
    """All data to draw."""

    bodies: Mapping[str, BodySnapshot] = field(default_factory=dict)
    """By the body's id."""
    sensors: Mapping[str, FloatArray] = field(default_factory=dict)
    """T_map_sensor (4, 4) by the sensor's name."""
    raw: Mapping[str, tuple[SkeletonSample, ...]] = field(default_factory=dict)
    """All persons of each sensor, by the sensor's name."""
    imus: tuple[str, ...] = ()
    """Segments with an aligned IMU."""
    robot: RobotSnapshot | None = None
    """The robot, if there is one."""
