"""No filter: the orientation that the sensor itself sends."""

from imu_bridge.filters.orientation_filter import OrientationFilter, SampleRound
from pose_core.arrays import FloatArray


class DeviceOrientation(OrientationFilter):
    """Uses the device's own orientation.

    Devices do not state the reference and uncertainty of their heading: it counts as unknown.
    """

    def update(self, samples: SampleRound) -> FloatArray:
        """See :class:`OrientationFilter`."""
        return samples.device_orientation
