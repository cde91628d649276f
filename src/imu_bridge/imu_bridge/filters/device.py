"""No filter: the orientation that the sensor itself sends."""

import numpy as np
from numpy.typing import NDArray

from imu_bridge.filters.orientation_filter import UNKNOWN_HEADING, FilterSettings, SampleRound
from pose_core.arrays import FloatArray


class DeviceOrientation:
    """An :class:`OrientationFilter` that uses the device's own orientation.

    Devices do not state the reference and uncertainty of their heading: it counts as unknown.

    Args:
        count: The number n of sensors.
        settings: Not used.
    """

    def __init__(self, count: int, settings: FilterSettings) -> None:
        self.bias: FloatArray = np.zeros((count, 3))
        self.rests: NDArray[np.int64] = np.zeros(count, dtype=int)
        self.rejected: NDArray[np.int64] = np.zeros(count, dtype=int)
        self.heading_stddev: FloatArray = np.full(count, UNKNOWN_HEADING)

    def reset(self, index: int) -> None:
        """No state to reset."""

    def update(self, samples: SampleRound) -> FloatArray:
        """See :class:`OrientationFilter`."""
        return samples.device_orientation
