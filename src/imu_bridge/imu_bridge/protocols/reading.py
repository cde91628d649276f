"""What a parser makes of bytes: one sample of one sensor, in SI units."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from pose_core.counters import Counters

STANDARD_GRAVITY = 9.80665  # [m/s^2] / [g]

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
