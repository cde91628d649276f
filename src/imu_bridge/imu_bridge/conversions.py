"""Conversion of samples to serialised ``sensor_msgs`` (REP 145)."""

import struct
from collections.abc import Sequence
from typing import Any

from rclpy.serialization import serialize_message
from sensor_msgs.msg import Imu, MagneticField

from pose_core.stamps import put_serialized_ns

VECTOR = struct.Struct("<3d")
QUATERNION = struct.Struct("<4d")
NUMBER = struct.Struct("<d")
IMU_NUMBERS, MAG_NUMBERS = 37, 12  # [-] at the end of a message
ORIENTATION, HEADING_VARIANCE, RATE, ACCELERATION = 0, 12, 13, 25  # indices among an Imu's numbers


class SegmentMessages:
    """The messages of one segment, serialised once; each sample overwrites the numbers.

    Filling and serialising a message takes 9 µs, overwriting its numbers 2.5 µs, at several
    thousand messages per second.

    Args:
        segment: The body segment; the frame is ``imu_<segment>_link``.
        inclination_stddev: Standard deviation of the orientation about the world's x and y [rad].
    """

    def __init__(self, segment: str, inclination_stddev: float) -> None:
        frame_id = f"imu_{segment}_link"
        raw, mag, data = Imu(), MagneticField(), Imu()
        raw.orientation_covariance[0] = -1.0  # REP 145: there is no orientation
        inclination = inclination_stddev**2
        data.orientation_covariance[0] = data.orientation_covariance[4] = inclination
        for message in (raw, mag, data):
            message.header.frame_id = frame_id
        self._raw = _Template(raw, IMU_NUMBERS)
        self._mag = _Template(mag, MAG_NUMBERS)
        self._data = _Template(data, IMU_NUMBERS)

    def raw(self, stamp_ns: int, rate: Sequence[float], acceleration: Sequence[float]) -> bytes:
        """``data_raw``: angular velocity [rad/s] and specific force [m/s^2]."""
        self._raw.put(VECTOR, RATE, *rate)
        self._raw.put(VECTOR, ACCELERATION, *acceleration)
        return self._raw.stamped(stamp_ns)

    def magnetic_field(self, stamp_ns: int, field: Sequence[float]) -> bytes:
        """``mag``: magnetic field [T]."""
        self._mag.put(VECTOR, 0, *field)
        return self._mag.stamped(stamp_ns)

    def oriented(
        self,
        stamp_ns: int,
        rate: Sequence[float],
        acceleration: Sequence[float],
        orientation: Sequence[float],
        heading_stddev: float,
    ) -> bytes:
        """``data``: the same with the orientation (x, y, z, w) in the world.

        An unknown heading has the standard deviation pi.
        """
        self._data.put(QUATERNION, ORIENTATION, *orientation)
        self._data.put(NUMBER, HEADING_VARIANCE, heading_stddev * heading_stddev)
        self._data.put(VECTOR, RATE, *rate)
        self._data.put(VECTOR, ACCELERATION, *acceleration)
        return self._data.stamped(stamp_ns)


class _Template:
    """A message's bytes, with its stamp at the beginning and its numbers at the end."""

    def __init__(self, message: Any, numbers: int) -> None:
        self._data = bytearray(serialize_message(message))
        self._first = len(self._data) - numbers * NUMBER.size

    def put(self, form: struct.Struct, number: int, *values: float) -> None:
        """Overwrite numbers from the index ``number`` on."""
        form.pack_into(self._data, self._first + number * NUMBER.size, *values)

    def stamped(self, stamp_ns: int) -> bytes:
        """The message with this stamp [ns]."""
        put_serialized_ns(self._data, stamp_ns)
        return bytes(self._data)
