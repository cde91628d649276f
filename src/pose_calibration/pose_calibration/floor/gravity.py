"""The vertical from an accelerometer or from IMUs instead of the person's stance."""

from dataclasses import dataclass

import numpy as np

from pose_core.api import FloatArray

ACCELEROMETER = "the sensor's accelerometer"
STANDARD_GRAVITY = 9.80665  # [m/s²] (CGPM 1901)
GRAVITY_TOLERANCE = 0.5  # [m/s²] a sensor that stands still measures gravity alone
ACCELEROMETER_STDDEV = np.radians(0.5)  # [rad] of a bias of 0.08 m/s², which no averaging removes
MIN_READINGS = 50  # [-]


@dataclass(frozen=True, kw_only=True)
class Gravity:
    """Up in the reference sensor's frame."""

    up: FloatArray  # (3,) unit vector in the reference's optical frame
    stddev: float  # [rad]
    source: str


class AccelerometerGravity:
    """Up from the accelerometer of a sensor that stands still.

    Readings that are no gravity alone, because somebody touches the sensor, are left out.
    """

    def __init__(self) -> None:
        self.readings = 0
        self.left_out = 0
        self._sum = np.zeros(3)

    def add(self, acceleration: FloatArray) -> None:
        """Take a reading, (3,) [m/s²] in the sensor's optical frame; at rest it points up."""
        if not abs(float(np.linalg.norm(acceleration)) - STANDARD_GRAVITY) < GRAVITY_TOLERANCE:
            self.left_out += 1
            return
        self.readings += 1
        self._sum += acceleration

    def gravity(self) -> Gravity | None:
        """Up in the sensor's frame; ``None`` before enough readings."""
        length = float(np.linalg.norm(self._sum))
        if self.readings < MIN_READINGS or length == 0.0:
            return None
        up = self._sum / length
        return Gravity(up=up, stddev=float(ACCELEROMETER_STDDEV), source=ACCELEROMETER)
