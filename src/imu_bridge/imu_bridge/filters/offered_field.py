"""Which magnetic fields are offered to a filter at all: none, a sensor's first ones, or every one.

A heading that is set once drifts with what is left of the gyroscope's bias, slowly and evenly, so
that cameras can follow it. One that goes on following the field bends with whatever iron the
sensor passes.
"""

import numpy as np

from imu_bridge.filters.orientation_filter import FloatArray, SampleRound

START_S = 10.0  # [s] after a sensor's first sample: noise is averaged, little has drifted


class OfferedField:
    """Chooses by the mode, one of :data:`MAGNETOMETER_MODES`.

    Args:
        count: The number n of sensors.
        mode: ``off``: none; ``start``: those of a sensor's first seconds; else every one.
    """

    def __init__(self, count: int, mode: str) -> None:
        self._longest_s = {"off": -1.0, "start": START_S}.get(mode, np.inf)
        self._since_s = np.zeros(count)

    def reset(self, index: int) -> None:
        """One sensor begins anew."""
        self._since_s[index] = 0.0

    def of(self, samples: SampleRound) -> FloatArray:
        """The samples' magnetic fields [T], shape (k, 3), NaN where there is none to be used."""
        self._since_s[samples.index] += samples.dt
        is_offered = self._since_s[samples.index] <= self._longest_s
        return np.where(is_offered[:, None], samples.magnetic_field, np.nan)
