"""What a parser makes of bytes: one sample of one sensor, in SI units."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from pose_core.counters import Counters

STANDARD_GRAVITY = 9.80665  # [m/s^2] / [g]

MAX_ACCELERATION = 4000.0  # [m/s^2] 400 g: the widest range of any body-worn accelerometer
MAX_ANGULAR_VELOCITY = 100.0  # [rad/s] 5700 deg/s
MAX_QUATERNION = 2.0  # [-] of one with a norm about 1
MAX_MAGNETIC_FIELD = 0.1  # [T] beside a strong magnet; the earth's is 5e-5

Vector3 = tuple[float, float, float]
Vector4 = tuple[float, float, float, float]


@dataclass(frozen=True, kw_only=True, slots=True)
class Reading:
    """One sample, in the axes of the sensor.

    Attributes:
        angular_velocity: [rad/s].
        acceleration: Specific force [m/s^2]: +g upwards when at rest.
        magnetic_field: [T]; None where the sample brings no new one.
        orientation: The device's own estimate of ``R_world_sensor`` as (x, y, z, w), its world z
            up; None if it sends none.
        node_id: Which sensor on the port; 0 where there is but one.
        sequence: Counts this sensor's samples modulo 2^16; None if the device does not count.
        clock_us: The device's clock at the moment of sampling [us], modulo the parser's
            ``clock_modulus_us``; None if it tells no time.
        saturated: Whether an axis of accelerometer or gyroscope is at full scale.
    """

    angular_velocity: Vector3
    acceleration: Vector3
    magnetic_field: Vector3 | None = None
    orientation: Vector4 | None = None
    node_id: int = 0
    sequence: int | None = None
    clock_us: int | None = None
    saturated: bool = False


def is_plausible(reading: Reading) -> bool:
    """Whether a sensor can have measured this: a filter remembers what it cannot for ever."""
    limits = (
        (reading.angular_velocity, MAX_ANGULAR_VELOCITY),
        (reading.acceleration, MAX_ACCELERATION),
        (reading.magnetic_field or (), MAX_MAGNETIC_FIELD),
        (reading.orientation or (), MAX_QUATERNION),
    )
    return all(-limit <= value <= limit for values, limit in limits for value in values)


class Parser(Protocol):
    """Finds a device's samples in a byte stream that may be cut, noisy or joined in its middle.

    Attributes:
        counters: At least ``frames``: whatever was intact, and ``bytes_skipped``: bytes that
            belong to nothing intact. The other names are the protocol's own.
        clock_modulus_us: Where the device's clock wraps [us].
    """

    counters: Counters
    clock_modulus_us: int

    def parse(self, data: bytes) -> Sequence[Reading]:
        """Add received bytes; the readings that they complete, in order."""

    def finish(self) -> Sequence[Reading]:
        """End the stream (the port is gone): what is pending will not become longer."""
