"""From samples to ``sensor_msgs`` (REP 145)."""

from collections.abc import Sequence

from sensor_msgs.msg import Imu, MagneticField

from pose_common.conversions import ns_to_stamp


class SegmentMessages:
    """The messages of one segment, filled anew for every sample.

    Making a message costs more than filling it, and at several thousand a second that counts; a
    message may be filled again as soon as ``publish`` has returned.

    Args:
        segment: The body segment; the frame is ``imu_<segment>_link``.
        inclination_stddev: Of the orientation about the world's x and y [rad].
    """

    def __init__(self, segment: str, inclination_stddev: float) -> None:
        frame_id = f"imu_{segment}_link"
        self._raw = Imu()
        self._raw.orientation_covariance[0] = -1.0  # REP 145: there is no orientation
        self._mag = MagneticField()
        self._data = Imu()
        inclination = inclination_stddev**2
        self._data.orientation_covariance[0] = self._data.orientation_covariance[4] = inclination
        for message in (self._raw, self._mag, self._data):
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
        heading_stddev: float,
    ) -> Imu:
        """``data``: the same with the orientation (x, y, z, w) in the world.

        A heading that is not known has the standard deviation pi.
        """
        message = self._data
        message.orientation_covariance[8] = heading_stddev * heading_stddev
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
