"""Result of a parser: one sample of one sensor, in SI units."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from pose_core.counters import Counters

STANDARD_GRAVITY = 9.80665  # [m/s^2] / [g]
FULL_SCALE_COUNTS = 32768  # [-] an i16 spans one range to each side

MAX_ACCELERATION = 4000.0  # [m/s^2] 400 g: the widest range of any body-worn accelerometer
MAX_ANGULAR_VELOCITY = 100.0  # [rad/s] 5700 deg/s
MAX_QUATERNION = 2.0  # [-] component of a quaternion
MAX_MAGNETIC_FIELD = 0.1  # [T] near a strong magnet; the earth's is 5e-5

Vector3 = tuple[float, float, float]
Vector4 = tuple[float, float, float, float]


@dataclass(frozen=True, kw_only=True, slots=True)
class Reading:
    """One sample in the axes of the sensor."""

    angular_velocity: Vector3  # [rad/s]
    acceleration: Vector3  # [m/s^2] specific force: +g upwards when at rest
    magnetic_field: Vector3 | None = None  # [T]; None if the sample has no new one
    orientation: Vector4 | None = None
    """The device's own estimate of ``R_world_sensor`` as (x, y, z, w), its world z up."""
    node_id: int = 0  # of the sensor on the port; 0 if there is only one
    sequence: int | None = None  # number of the sample modulo 2^16; None if the device has none
    clock_us: int | None = None
    """The device's clock at the time of sampling [us], modulo the parser's ``clock_modulus_us``."""
    saturated: bool = False  # whether an axis of accelerometer or gyroscope is at full scale


def scaled(counts: Sequence[int], lsb: float) -> Vector3:
    """A sample's three counts in the unit of one count's value."""
    x, y, z = counts
    return (x * lsb, y * lsb, z * lsb)


def is_saturated(*axes: int) -> bool:
    """Whether one of some counts, each an i16, is at full scale."""
    return min(axes) == -FULL_SCALE_COUNTS or max(axes) == FULL_SCALE_COUNTS - 1


def is_plausible(reading: Reading) -> bool:
    """Whether a sample is within the range of sensors: others would corrupt a filter's state."""
    limits = (
        (reading.angular_velocity, MAX_ANGULAR_VELOCITY),
        (reading.acceleration, MAX_ACCELERATION),
        (reading.magnetic_field or (), MAX_MAGNETIC_FIELD),
        (reading.orientation or (), MAX_QUATERNION),
    )
    return all(-limit <= value <= limit for values, limit in limits for value in values)


class Parser(Protocol):
    """Decodes a device's samples from a byte stream that may be truncated or noisy.

    Attributes:
        counters: At least ``frames``: intact frames, and ``bytes_skipped``: bytes outside of intact
            frames. Other names are specific to the protocol.
        clock_modulus_us: Modulus of the device's clock [us].
    """

    counters: Counters
    clock_modulus_us: int

    def parse(self, data: bytes) -> Sequence[Reading]:
        """Add received bytes; returns the samples that they complete, in order."""

    def finish(self) -> Sequence[Reading]:
        """End the stream when the port is lost; returns samples from the remaining bytes."""
