"""From samples to ``sensor_msgs`` (REP 145)."""

import math
from collections.abc import Sequence

from sensor_msgs.msg import Imu, MagneticField

from pose_common.conversions import ns_to_stamp

UNKNOWN_HEADING_VARIANCE = math.pi**2  # [rad^2] says: any heading


class SegmentMessages:
    """The messages of one segment, filled anew for every sample.

    Making a message costs more than filling it, and at several thousand a second that counts; a
    message may be filled again as soon as ``publish`` has returned.

    Args:
        segment: The body segment; the frame is ``imu_<segment>_link``.
        inclination_stddev: Of the orientation about the world's x and y [rad].
        heading_stddev: About the world's z, where there is a heading [rad].
    """

    def __init__(self, segment: str, inclination_stddev: float, heading_stddev: float) -> None:
        frame_id = f"imu_{segment}_link"
        self._raw = Imu()
        self._raw.orientation_covariance[0] = -1.0  # REP 145: there is no orientation
        self._mag = MagneticField()
        self._with_heading = Imu()
        self._without_heading = Imu()
        inclination = inclination_stddev**2
        for message, heading in (
            (self._with_heading, heading_stddev**2),
            (self._without_heading, UNKNOWN_HEADING_VARIANCE),
        ):
            covariance = [inclination, 0.0, 0.0, 0.0, inclination, 0.0, 0.0, 0.0, heading]
            message.orientation_covariance = covariance
        for message in (self._raw, self._mag, self._with_heading, self._without_heading):
            message.header.frame_id = frame_id

    def raw(self, stamp_ns: int, rate: Sequence[float], acceleration: Sequence[float]) -> Imu:
        """``data_raw``: angular velocity [rad/s] and specific force [m/s^2]."""
        return _fill(self._raw, stamp_ns, rate, acceleration)

    def magnetic_field(self, stamp_ns: int, field: Sequence[float]) -> MagneticField:
        """``mag``: magnetic field [T]."""
        self._mag.header.stamp = ns_to_stamp(stamp_ns)
        vector = self._mag.magnetic_field
        vector.x, vector.y, vector.z = field
        return self._mag

    def oriented(
        self,
        stamp_ns: int,
        rate: Sequence[float],
        acceleration: Sequence[float],
        orientation: Sequence[float],
        has_heading: bool,
    ) -> Imu:
        """``data``: the same with the orientation (x, y, z, w) in the world."""
        message = self._with_heading if has_heading else self._without_heading
        q = message.orientation
        q.x, q.y, q.z, q.w = orientation
        return _fill(message, stamp_ns, rate, acceleration)


def _fill(message: Imu, stamp_ns: int, rate: Sequence[float], acceleration: Sequence[float]) -> Imu:
    message.header.stamp = ns_to_stamp(stamp_ns)
    vector = message.angular_velocity
    vector.x, vector.y, vector.z = rate
    vector = message.linear_acceleration
    vector.x, vector.y, vector.z = acceleration
    return message
