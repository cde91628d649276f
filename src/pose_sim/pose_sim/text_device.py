"""A board with an Arduino sketch: one line of numbers per sample."""

import numpy as np
from numpy.typing import ArrayLike

from imu_bridge.protocols.reading import STANDARD_GRAVITY

FIELDS = ("time", *(f"{quantity}_{axis}" for quantity in ("acc", "gyro", "mag") for axis in "xyz"))
UNITS = {"time": "ms", "acc": "g", "gyro": "deg/s", "mag": "uT"}
"""Fields and units of the lines, as in a nodes file."""


def line(
    time_us: int, acceleration: ArrayLike, angular_velocity: ArrayLike, magnetic_field: ArrayLike
) -> bytes:
    """Encode one sample.

    Args:
        time_us: The board's clock [us], printed in milliseconds.
        acceleration: [m/s^2], shape (3,).
        angular_velocity: [rad/s], shape (3,).
        magnetic_field: [T], shape (3,).
    """
    numbers = [
        *np.asarray(acceleration) / STANDARD_GRAVITY,
        *np.degrees(np.asarray(angular_velocity)),
        *np.asarray(magnetic_field) * 1e6,
    ]
    return (f"{time_us // 1000}," + ",".join(f"{x:.3f}" for x in numbers) + "\r\n").encode()
