"""Selection of the magnetic fields for a filter: none, a sensor's first ones, or all.

A heading that is set once drifts slowly and steadily with the gyroscope's remaining bias, which
cameras can correct. A heading that is corrected by the field all the time is disturbed by iron
near the sensor.
"""

import numpy as np

from imu_bridge.filters.orientation_filter import SampleRound
from pose_core.arrays import FloatArray

START_S = 10.0  # [s] after a sensor's first sample: averages the noise, with little drift


class OfferedField:
    """Selects by the mode, one of :data:`MAGNETOMETER_MODES`.

    Args:
        count: The number n of sensors.
        mode: ``off``: none; ``start``: those of a sensor's first seconds; otherwise all.
    """

    def __init__(self, count: int, mode: str) -> None:
        self._longest_s = {"off": -1.0, "start": START_S}.get(mode, np.inf)
        self._since_s = np.zeros(count)

    def reset(self, index: int) -> None:
        """Restart one sensor."""
        self._since_s[index] = 0.0

    def of(self, samples: SampleRound) -> FloatArray:
        """The selected magnetic fields [T], shape (k, 3), NaN elsewhere."""
        self._since_s[samples.index] += samples.dt
        is_offered = self._since_s[samples.index] <= self._longest_s
        return np.where(is_offered[:, None], samples.magnetic_field, np.nan)
