r"""Frames that the sink of a star network of IMU nodes sends to the host.

Every number is little-endian. A frame is

====== ==== ===========================================================================
offset size field
====== ==== ===========================================================================
0      2    sync, ``A5 5A``
2      1    length L of the payload, 1 to 64
3      L    payload; its first byte is the kind
3 + L  2    CRC-16/CCITT-FALSE over bytes 2 to 2 + L (length and payload)
====== ==== ===========================================================================

and the payload of kind ``0x11``, a 9-axis sample (28 bytes, so the frame has 33), is

====== ==== ===========================================================================
offset size field
====== ==== ===========================================================================
0      1    kind: version in the high nibble (1), type in the low (1)
1      1    node id
2      2    sequence number, u16, +1 per sample of this node, wraps
4      4    node clock [us] at the time of sampling, u32, wraps after 71.6 min
8      1    range codes: bits 0-1 accelerometer, 2-3 gyroscope, 4-5 magnetometer
9      1    flags: bit 0 = the magnetometer counts are new and valid
10     6    accelerometer x, y, z, i16
16     6    gyroscope x, y, z, i16
22     6    magnetometer x, y, z, i16, in the axes of the accelerometer
====== ==== ===========================================================================

A later version may append to a payload: of a longer payload of a known kind the rest is ignored.
Frames of an unknown kind are skipped and counted.
"""

import math
import struct
from binascii import crc_hqx
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from imu_bridge.protocols.reading import (
    FULL_SCALE_COUNTS,
    STANDARD_GRAVITY,
    Reading,
    is_saturated,
    scaled,
)
from pose_core.counters import Counters

SYNC = b"\xa5\x5a"
KIND_SAMPLE = 0x11
MAX_PAYLOAD_BYTES = 64
CLOCK_MODULUS_US = 1 << 32

ACCELEROMETER_RANGES_G = (2.0, 4.0, 8.0, 16.0)  # [g] by range code, MPU-9150
GYROSCOPE_RANGES_DPS = (250.0, 500.0, 1000.0, 2000.0)  # [deg/s] by range code, MPU-9150
MAGNETOMETER_LSB_UT = (0.3, 0.15, 0.6, 0.0625)  # [uT] / count by range code; 0 is the MPU-9150

ACCELEROMETER_LSB = tuple(g * STANDARD_GRAVITY / FULL_SCALE_COUNTS for g in ACCELEROMETER_RANGES_G)
"""[m/s^2] / count by range code."""
GYROSCOPE_LSB = tuple(math.radians(dps) / FULL_SCALE_COUNTS for dps in GYROSCOPE_RANGES_DPS)
"""[rad/s] / count by range code."""
MAGNETOMETER_LSB = tuple(ut * 1e-6 for ut in MAGNETOMETER_LSB_UT)
"""[T] / count by range code."""

_PREFIX_BYTES = 3  # sync and length
_CRC_BYTES = 2
_SAMPLE = struct.Struct("<BBHIBB9h")

Counts3 = tuple[int, int, int]


@dataclass(frozen=True, kw_only=True, slots=True)
class RawSample:
    """One 9-axis sample of one node, in counts as transmitted.

    The range codes (0 to 3) index :data:`ACCELEROMETER_LSB`, :data:`GYROSCOPE_LSB` and
    :data:`MAGNETOMETER_LSB`, which convert counts to SI units.
    """

    node_id: int
    sequence: int
    clock_us: int
    accelerometer: Counts3
    gyroscope: Counts3
    magnetometer: Counts3 = (0, 0, 0)
    magnetometer_valid: bool = False
    accelerometer_range: int = 0
    gyroscope_range: int = 0
    magnetometer_range: int = 0


def encode(sample: RawSample) -> bytes:
    """Encode a sample as a frame.

    Raises:
        ValueError: If a value exceeds its field in the frame.
    """
    codes = (sample.accelerometer_range, sample.gyroscope_range, sample.magnetometer_range)
    if not all(0 <= code <= 3 for code in codes):
        raise ValueError(f"range codes {codes} are not all within 0 to 3")
    try:
        payload = _SAMPLE.pack(
            KIND_SAMPLE,
            sample.node_id,
            sample.sequence,
            sample.clock_us,
            codes[0] | codes[1] << 2 | codes[2] << 4,
            int(sample.magnetometer_valid),
            *sample.accelerometer,
            *sample.gyroscope,
            *sample.magnetometer,
        )
    except struct.error as error:
        raise ValueError(f"{sample} does not fit a frame: {error}") from error
    return frame(payload)


def frame(payload: bytes) -> bytes:
    """Wrap a payload of 1 to 64 bytes into sync, length and CRC.

    Raises:
        ValueError: If it has another size.
    """
    if not 1 <= len(payload) <= MAX_PAYLOAD_BYTES:
        raise ValueError(f"payload of {len(payload)} bytes; 1 to {MAX_PAYLOAD_BYTES} fit a frame")
    body = bytes([len(payload)]) + payload
    return SYNC + body + crc16(body).to_bytes(_CRC_BYTES, "little")


def crc16(data: bytes | memoryview) -> int:
    """CRC-16/CCITT-FALSE: polynomial 0x1021, initial value 0xFFFF, nothing reflected."""
    return crc_hqx(data, 0xFFFF)


def quantise(values: ArrayLike, lsb: float) -> NDArray[np.int16]:
    """Counts of measured values, saturated as a sensor does.

    Args:
        values: Values in any unit, any shape.
        lsb: Value of one count in that unit, for instance ``GYROSCOPE_LSB[3]``.
    """
    counts = np.rint(np.asarray(values, dtype=float) / lsb)
    return np.clip(counts, -FULL_SCALE_COUNTS, FULL_SCALE_COUNTS - 1).astype(np.int16)


def reading(sample: RawSample) -> Reading:
    """The sample in SI units."""
    field = None
    if sample.magnetometer_valid:
        field = scaled(sample.magnetometer, MAGNETOMETER_LSB[sample.magnetometer_range])
    return Reading(
        angular_velocity=scaled(sample.gyroscope, GYROSCOPE_LSB[sample.gyroscope_range]),
        acceleration=scaled(sample.accelerometer, ACCELEROMETER_LSB[sample.accelerometer_range]),
        magnetic_field=field,
        node_id=sample.node_id,
        sequence=sample.sequence,
        clock_us=sample.clock_us,
        saturated=is_saturated(*sample.accelerometer, *sample.gyroscope),
    )


class StarParser:
    """A :class:`~imu_bridge.protocols.reading.Parser` of the star network's frames.

    A sync word may occur inside a payload or in noise: if the CRC is wrong, only the two sync bytes
    are skipped, so that a valid frame that starts within the false one is still found.

    Attributes:
        counters: ``frames`` decoded; ``crc_errors``: sync words whose frame failed its CRC;
            ``bytes_skipped``: bytes outside of intact frames; ``unknown_kinds``: intact
            frames that are not 9-axis samples of version 1.
    """

    clock_modulus_us = CLOCK_MODULUS_US

    def __init__(self) -> None:
        self.counters = Counters("frames", "crc_errors", "bytes_skipped", "unknown_kinds")
        self._pending = b""

    def parse(self, data: bytes) -> list[Reading]:
        """See :class:`~imu_bridge.protocols.reading.Parser`."""
        return self._scan(self._pending + data, final=False)

    def finish(self) -> list[Reading]:
        """See :class:`~imu_bridge.protocols.reading.Parser`."""
        return self._scan(self._pending, final=True)

    def _scan(self, data: bytes, *, final: bool) -> list[Reading]:
        """The samples in ``data``; the remaining bytes may be an incomplete frame."""
        samples: list[Reading] = []
        skipped = crc_errors = 0
        view = memoryview(data)
        position = 0
        while True:
            start = data.find(SYNC, position)
            if start < 0:
                # The last byte may be the first half of a sync word.
                half = not final and data[position:].endswith(SYNC[:1])
                rest = len(data) - half
                break
            skipped += start - position
            position = rest = start
            length = data[start + 2] if start + 2 < len(data) else 1
            end = start + _PREFIX_BYTES + length + _CRC_BYTES
            is_frame = 1 <= length <= MAX_PAYLOAD_BYTES and not (final and end > len(data))
            if is_frame and end > len(data):
                break
            crc_at = end - _CRC_BYTES
            crc = int.from_bytes(view[crc_at:end], "little")
            if not is_frame or crc16(view[start + 2 : crc_at]) != crc:
                crc_errors += is_frame
                position += len(SYNC)
                skipped += len(SYNC)
                continue
            position = end
            if data[start + 3] == KIND_SAMPLE and length >= _SAMPLE.size:
                samples.append(reading(_sample(_SAMPLE.unpack_from(data, start + _PREFIX_BYTES))))
            else:
                self.counters.add("unknown_kinds")
        skipped += rest - position
        self.counters.add("frames", len(samples))
        self.counters.add("crc_errors", crc_errors)
        self.counters.add("bytes_skipped", skipped)
        self._pending = data[rest:]
        return samples


def _sample(fields: tuple[int, ...]) -> RawSample:
    _, node_id, sequence, clock_us, ranges, flags, ax, ay, az, gx, gy, gz, mx, my, mz = fields
    return RawSample(
        node_id=node_id,
        sequence=sequence,
        clock_us=clock_us,
        accelerometer=(ax, ay, az),
        gyroscope=(gx, gy, gz),
        magnetometer=(mx, my, mz),
        magnetometer_valid=bool(flags & 1),
        accelerometer_range=ranges & 3,
        gyroscope_range=ranges >> 2 & 3,
        magnetometer_range=ranges >> 4 & 3,
    )
