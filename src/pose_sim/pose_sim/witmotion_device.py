"""Emulation of a WitMotion WT901 by its datasheet: the packets of each sample.

References:
    WitMotion, WT901 datasheet, section 5.1, output data format.
"""

import struct

import numpy as np
from numpy.typing import ArrayLike

from imu_bridge.protocols.reading import STANDARD_GRAVITY
from pose_core.arrays import FloatArray

US_PER_MS = 1000
CONTENT = (0x51, 0x52, 0x54)
"""Default kinds of packets: acceleration, angular velocity, magnetic field."""


def packets(
    *,
    acceleration: ArrayLike,
    angular_velocity: ArrayLike,
    magnetic_field: ArrayLike = (0.0, 0.0, 0.0),
    orientation: ArrayLike = (0.0, 0.0, 0.0, 1.0),
    roll_pitch_yaw: ArrayLike = (0.0, 0.0, 0.0),
    time_us: int = 0,
    content: tuple[int, ...] = CONTENT,
) -> bytes:
    """Encode the packets of one sample.

    Args:
        acceleration: [m/s^2], shape (3,).
        angular_velocity: [rad/s], shape (3,).
        magnetic_field: [T], shape (3,).
        orientation: x, y, z, w, shape (4,).
        roll_pitch_yaw: [rad], shape (3,).
        time_us: The time of day [us].
        content: Kinds of packets to send (register RSW), in ascending order.
    """
    x, y, z, w = np.asarray(orientation, dtype=float)
    counts = {
        0x51: np.asarray(acceleration) * (32768.0 / 16.0 / STANDARD_GRAVITY),
        0x52: np.degrees(angular_velocity) * (32768.0 / 2000.0),
        0x53: np.asarray(roll_pitch_yaw) * (32768.0 / np.pi),
        0x54: np.asarray(magnetic_field) * 1e7,  # [mG]
        0x59: np.array([w, x, y, z]) * 32768.0,
    }
    return b"".join(
        _packet(kind, _time(time_us) if kind == 0x50 else _i16(counts[kind])) for kind in content
    )


def _packet(kind: int, content: bytes) -> bytes:
    body = bytes([0x55, kind]) + content
    return body + bytes([sum(body) & 0xFF])


def _i16(counts: FloatArray) -> bytes:
    """Encode three or four counts, saturated; a missing fourth is 0."""
    whole = np.clip(np.rint(counts), -32768, 32767).astype(int).tolist()
    return struct.pack("<4h", *(whole + [0])[:4])


def _time(time_of_day_us: int) -> bytes:
    ms = time_of_day_us // US_PER_MS
    hour, minute, second = ms // 3_600_000 % 24, ms // 60_000 % 60, ms // 1000 % 60
    return struct.pack("<6BH", 24, 1, 31, hour, minute, second, ms % 1000)
