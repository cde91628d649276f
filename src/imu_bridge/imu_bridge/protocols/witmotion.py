"""WitMotion's serial packets (WT901 and related devices), one sensor per port.

Every packet has 11 bytes: ``55``, the kind, four little-endian i16 and the sum of the ten bytes
before, modulo 256. The packets of one sample are sent in ascending order of kind:

==== ============================================ ========================================
kind content                                      scale
==== ============================================ ========================================
50   year, month, day, hour, minute, second, ms   bytes; the milliseconds an u16
51   acceleration x, y, z, temperature            16 g / 32768
52   angular velocity x, y, z, voltage            2000 deg/s / 32768
53   roll, pitch, yaw, version                    180 deg / 32768, R = Rz(yaw) Ry Rx(roll)
54   magnetic field x, y, z, temperature          1 mG
59   quaternion w, x, y, z                        1 / 32768
==== ============================================ ========================================

Kinds 55 to 58 and 5A (ports, air pressure, GPS) are ignored. A sample needs acceleration and
angular velocity.

References:
    WitMotion, WT901 datasheet, sections 5.1 (output data format) and 5.2 (commands).
"""

import math
import struct

from imu_bridge.protocols.reading import (
    FULL_SCALE_COUNTS,
    STANDARD_GRAVITY,
    Reading,
    Vector4,
    is_saturated,
    scaled,
)
from pose_core.counters import Counters

HEADER = 0x55
PACKET_BYTES = 11
OF_A_SAMPLE = (0x50, 0x51, 0x52, 0x53, 0x54, 0x59)
TIME, ACCELERATION, ANGULAR_VELOCITY, ANGLE, MAGNETIC_FIELD, QUATERNION = OF_A_SAMPLE
LAST_KIND = 0x5A

ACCELERATION_LSB = 16.0 * STANDARD_GRAVITY / FULL_SCALE_COUNTS  # [m/s^2]
ANGULAR_VELOCITY_LSB = math.radians(2000.0) / FULL_SCALE_COUNTS  # [rad/s]
ANGLE_LSB = math.pi / FULL_SCALE_COUNTS  # [rad]
MAGNETIC_FIELD_LSB = 1e-7  # [T] 1 mG
US_PER_DAY = 86_400_000_000

_I16 = struct.Struct("<4h")
_TIME = struct.Struct("<6BH")

Counts = tuple[int, ...]


class WitMotionParser:
    """A :class:`Parser` of these packets.

    Attributes:
        counters: ``frames``: packets with the right sum; ``checksum_errors``; ``bytes_skipped``;
            ``other_packets``: of ignored kinds; ``incomplete_samples``: samples without
            acceleration or angular velocity, or without the time if others have it.
        clock_modulus_us: The clock is the time of day.
    """

    def __init__(self) -> None:
        self.counters = Counters(
            "frames", "checksum_errors", "bytes_skipped", "other_packets", "incomplete_samples"
        )
        self.clock_modulus_us = US_PER_DAY
        self._pending = b""
        self._sampling: dict[int, Counts] = {}
        self._last_kind = LAST_KIND  # last kind of a sample, as far as known
        self._highest_kind = 0
        self._sends_time = False

    def parse(self, data: bytes) -> list[Reading]:
        """See :class:`Parser`."""
        data = self._pending + data
        readings: list[Reading] = []
        position = 0
        while True:
            start = data.find(HEADER, position)
            if start < 0:
                self.counters.add("bytes_skipped", len(data) - position)
                position = len(data)
                break
            self.counters.add("bytes_skipped", start - position)
            position = start
            packet = data[start : start + PACKET_BYTES]
            is_wrong_kind = len(packet) > 1 and not TIME <= packet[1] <= LAST_KIND
            if len(packet) < PACKET_BYTES and not is_wrong_kind:
                break
            is_wrong_sum = not is_wrong_kind and sum(packet[:-1]) & 0xFF != packet[-1]
            self.counters.add("checksum_errors", is_wrong_sum)
            if is_wrong_kind or is_wrong_sum:
                self.counters.add("bytes_skipped")
                position += 1
                continue
            position += PACKET_BYTES
            self.counters.add("frames")
            readings += self._packet(packet[1], packet[2:10])
        self._pending = data[position:]
        return readings

    def finish(self) -> list[Reading]:
        """See :class:`Parser`."""
        self.counters.add("bytes_skipped", len(self._pending))
        self._pending = b""
        return self._close()

    def _packet(self, kind: int, content: bytes) -> list[Reading]:
        if kind not in OF_A_SAMPLE:
            self.counters.add("other_packets")
            return []
        readings = []
        if self._sampling and kind <= max(self._sampling):
            # The highest kind received so far completes a sample before the next one starts.
            self._last_kind = self._highest_kind
            readings = self._close()
        self._sampling[kind] = (_TIME if kind == TIME else _I16).unpack(content)
        self._highest_kind = max(self._highest_kind, kind)
        if kind == self._last_kind:
            readings += self._close()
        return readings

    def _close(self) -> list[Reading]:
        """The completed sample."""
        sampling, self._sampling = self._sampling, {}
        if not sampling:
            return []
        self._sends_time |= TIME in sampling
        needed = {ACCELERATION, ANGULAR_VELOCITY} | ({TIME} if self._sends_time else set())
        if not needed <= sampling.keys():
            self.counters.add("incomplete_samples")
            return []
        return [_reading(sampling)]


def _reading(sampling: dict[int, Counts]) -> Reading:
    acceleration, rate = sampling[ACCELERATION][:3], sampling[ANGULAR_VELOCITY][:3]
    field = sampling.get(MAGNETIC_FIELD)
    return Reading(
        acceleration=scaled(acceleration, ACCELERATION_LSB),
        angular_velocity=scaled(rate, ANGULAR_VELOCITY_LSB),
        magnetic_field=None if field is None else scaled(field[:3], MAGNETIC_FIELD_LSB),
        orientation=_orientation(sampling),
        clock_us=_clock_us(sampling[TIME]) if TIME in sampling else None,
        saturated=is_saturated(*acceleration, *rate),
    )


def _orientation(sampling: dict[int, Counts]) -> Vector4 | None:
    if QUATERNION in sampling:
        w, x, y, z = (float(count) for count in sampling[QUATERNION])
        norm = math.sqrt(w * w + x * x + y * y + z * z)
        return (x / norm, y / norm, z / norm, w / norm) if norm > 0.0 else None
    if ANGLE not in sampling:
        return None
    (sr, cr), (sp, cp), (sy, cy) = (
        (math.sin(half), math.cos(half))
        for half in (0.5 * angle * ANGLE_LSB for angle in sampling[ANGLE][:3])
    )
    return (
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        cr * cp * cy + sr * sp * sy,
    )


def _clock_us(time: Counts) -> int:
    """The time of day [us]."""
    *_, hour, minute, second, ms = time
    return (((hour * 60 + minute) * 60 + second) * 1000 + ms) * 1000 % US_PER_DAY
