"""The vertical from an accelerometer, which replaces the estimate from the person's stance."""

from dataclasses import dataclass

import numpy as np

from pose_core.api import FloatArray

ACCELEROMETER = "the sensor's accelerometer"
STANDARD_GRAVITY = 9.80665  # [m/s²] (CGPM 1901)
GRAVITY_TOLERANCE = 0.5  # [m/s²] a sensor at rest measures gravity only
ACCELEROMETER_STDDEV = np.radians(0.5)  # [rad] from a bias of 0.08 m/s², which averaging leaves
MIN_READINGS = 50  # [-]


@dataclass(frozen=True, kw_only=True)
class Gravity:
    """Up in the reference sensor's frame."""

    up: FloatArray  # (3,) unit vector in the reference's optical frame
    stddev: float  # [rad]
    source: str


class AccelerometerGravity:
    """The vertical from the accelerometer of a sensor at rest.

    Measurements that differ from gravity, because the sensor is moved, are left out.
    """

    def __init__(self) -> None:
        self.readings = 0
        self.left_out = 0
        self._sum = np.zeros(3)

    def add(self, acceleration: FloatArray) -> None:
        """Add a measurement, (3,) [m/s²] in the sensor's optical frame; at rest it points up."""
        if not abs(float(np.linalg.norm(acceleration)) - STANDARD_GRAVITY) < GRAVITY_TOLERANCE:
            self.left_out += 1
            return
        self.readings += 1
        self._sum += acceleration

    def gravity(self) -> Gravity | None:
        """Up in the sensor's frame; ``None`` before enough measurements."""
        length = float(np.linalg.norm(self._sum))
        if self.readings < MIN_READINGS or length == 0.0:
            return None
        up = self._sum / length
        return Gravity(up=up, stddev=float(ACCELEROMETER_STDDEV), source=ACCELEROMETER)
