"""What the sensors say, as plain frozen values."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class SkeletonSample:
    """One person's joints as one sensor saw them."""

    stamp_ns: int  # [ns] moment of capture
    sensor: str
    person: str
    positions: FloatArray  # (15, 3) [m] in the sensor's optical frame; NaN where not tracked
    tracking_state: NDArray[np.uint8]  # (15,), values of TrackingState


@dataclass(frozen=True, kw_only=True)
class ImuSample:
    """One IMU's orientation."""

    stamp_ns: int  # [ns] moment of capture
    segment: str
    orientation: FloatArray  # (4,) quaternion x, y, z, w: R_world_sensor, world z up
    orientation_stddev: FloatArray  # (3,) [rad] about the world's x, y, z
    angular_velocity: FloatArray  # (3,) [rad/s] in the sensor's frame
