"""How one IMU sits on its segment, and how well that is known."""

from collections.abc import Mapping
from dataclasses import dataclass

from pose_core.streams.samples import FloatArray


@dataclass(frozen=True, kw_only=True)
class Mounting:
    """A sensor's orientation on its segment."""

    R_sensor_segment: FloatArray  # (3, 3)
    stddev: FloatArray  # (3,) [rad] about the segment's x, y, z
    residual: float  # [rad] RMS between the long axis as cameras and as the sensor have it


Mountings = Mapping[str, Mounting]
"""Mountings by segment."""
