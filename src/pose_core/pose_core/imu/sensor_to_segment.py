"""Sensor-to-segment rotation of one IMU, with its uncertainty."""

from collections.abc import Mapping
from dataclasses import dataclass

from pose_core.arrays import FloatArray


@dataclass(frozen=True, kw_only=True)
class SensorToSegment:
    """A sensor's orientation on its segment."""

    R_sensor_segment: FloatArray  # (3, 3)
    stddev: FloatArray  # (3,) [rad] about the segment's x, y, z
    exchanged_with: str = ""  # the segment it is worn on, if not its own
    z_down: bool = False  # whether the z axis of its reference frame points down
    slip: "Slip | None" = None  # when the sensor slipped, of a recording that has been read before


@dataclass(frozen=True, kw_only=True)
class Slip:
    """A time within which a sensor slipped on its segment, and its orientation afterwards."""

    begin_ns: int  # [ns]
    end_ns: int  # [ns]
    after: SensorToSegment


SensorsToSegments = Mapping[str, SensorToSegment]
"""Sensor-to-segment rotations by segment."""
