"""What the fusion says of one person at one instant."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from pose_fusion.streams.samples import FloatArray


class Source(IntEnum):
    """Where a degree of freedom's last update came from; the values of ``PoseEstimate``."""

    PREDICTED = 0
    KINECT = 1
    IMU = 2
    FUSED = 3


@dataclass(frozen=True, kw_only=True)
class BodyEstimate:
    """One person's pose with its uncertainty and provenance; arrays over d degrees of freedom."""

    stamp_ns: int  # [ns] the instant that is estimated
    newest_ns: int  # [ns] stamp of the newest sample of any source that had come by then
    dof_names: tuple[str, ...]
    position: FloatArray  # (d,) [m] or [rad]
    velocity: FloatArray  # (d,) [m/s] or [rad/s]
    position_stddev: FloatArray  # (d,) [m] or [rad]
    weight_kinect: FloatArray  # (d,) 0..1
    weight_imu: FloatArray  # (d,) 0..1
    source: NDArray[np.uint8]  # (d,), values of Source
    joints: FloatArray  # (15, 3) [m] in map
    tracking_state: NDArray[np.uint8]  # (15,), best of the sensors
    link_names: tuple[str, ...]
    T_map_link: FloatArray  # (links, 4, 4), origin at the joint it turns about
    sensor_weight: Mapping[str, FloatArray]  # (15,) each sensor's share in each joint
