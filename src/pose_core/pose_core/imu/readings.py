"""Attitude of a segment at one instant, as measured by its aligned IMU."""

from dataclasses import dataclass

from pose_core.streams.samples import FloatArray


@dataclass(frozen=True, kw_only=True)
class SegmentReading:
    """A segment's attitude and rate, measured by an aligned IMU."""

    R_map_segment: FloatArray  # (3, 3)
    angular_velocity: FloatArray  # (3,) [rad/s] in map
