"""Emulation of a WitMotion WT901 by its datasheet: the packets of each sample.

References:
    WitMotion, WT901 datasheet, section 5.1, output data format.
"""

import struct
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from imu_bridge.protocols.reading import STANDARD_GRAVITY

US_PER_MS = 1000
CONTENT = (0x51, 0x52, 0x54)
"""Default kinds of packets: acceleration, angular velocity, magnetic field."""


@dataclass(frozen=True, kw_only=True)
class Sampling:
    """Measurement at one instant, in SI units."""

    acceleration: ArrayLike  # (3,) [m/s^2]
    angular_velocity: ArrayLike  # (3,) [rad/s]
    magnetic_field: ArrayLike = (0.0, 0.0, 0.0)  # (3,) [T]
    orientation: ArrayLike = (0.0, 0.0, 0.0, 1.0)  # (4,) x, y, z, w
    roll_pitch_yaw: ArrayLike = (0.0, 0.0, 0.0)  # (3,) [rad]
    time_of_day_us: int = 0


def packets(sampling: Sampling, content: tuple[int, ...] = CONTENT) -> bytes:
    """Encode the packets of one sample.

    Args:
        sampling: The measurement.
        content: Kinds of packets to send (register RSW), in ascending order.
    """
    x, y, z, w = np.asarray(sampling.orientation, dtype=float)
    scaled = {
        0x51: np.asarray(sampling.acceleration) / (16.0 * STANDARD_GRAVITY),
        0x52: np.degrees(np.asarray(sampling.angular_velocity)) / 2000.0,
        0x53: np.asarray(sampling.roll_pitch_yaw) / np.pi,
        0x59: np.array([w, x, y, z]),
    }
    data = b""
    for kind in content:
        if kind == 0x50:
            data += _packet(kind, _time(sampling.time_of_day_us))
        elif kind == 0x54:
            milligauss = np.asarray(sampling.magnetic_field) * 1e7
            data += _packet(kind, _i16(milligauss))
        else:
            data += _packet(kind, _i16(scaled[kind] * 32768.0))
    return data


def _packet(kind: int, content: bytes) -> bytes:
    body = bytes([0x55, kind]) + content
    return body + bytes([sum(body) & 0xFF])


def _i16(counts: NDArray[np.float64]) -> bytes:
    """Encode three or four counts, saturated; a missing fourth is 0."""
    whole = np.clip(np.rint(counts), -32768, 32767).astype(int).tolist()
    return struct.pack("<4h", *(whole + [0])[:4])


def _time(time_of_day_us: int) -> bytes:
    ms = time_of_day_us // US_PER_MS
    hour, minute, second = ms // 3_600_000 % 24, ms // 60_000 % 60, ms // 1000 % 60
    return struct.pack("<6BH", 24, 1, 31, hour, minute, second, ms % 1000)
