"""Data to draw at one instant, of a live graph or of a recording."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from pose_core.api import FloatArray, SkeletonSample
from pose_core.joints import JOINTS, TrackingState
from pose_core.stamps import NS_PER_S
from pose_io.arrays import ByteArray
from pose_view.robot import RobotSnapshot

SILENT_S = 0.25  # [s] age of a camera's frame from which on it tracks nothing


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
    is_occluded: NDArray[np.bool_] | None = None
    """See :func:`occluded_joints`, of the first camera; None without one."""


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


def occluded_joints(seen: Sequence[SkeletonSample], stamp_ns: int) -> NDArray[np.bool_]:
    """Whether a camera does not track each joint at a stamp [ns], (15,).

    Args:
        seen: The camera's frame before the stamp; of several people the first one counts.
        stamp_ns: The stamp.
    """
    if not seen or stamp_ns - seen[0].stamp_ns > SILENT_S * NS_PER_S:
        return np.ones(len(JOINTS), bool)
    return np.asarray(seen[0].tracking_state < TrackingState.TRACKED)
