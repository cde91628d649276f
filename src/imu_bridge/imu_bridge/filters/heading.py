"""How well the headings are known: what a magnetometer gives, and what time takes away."""

import numpy as np
from numpy.typing import NDArray

from imu_bridge.filters.orientation_filter import (
    UNKNOWN_HEADING,
    BoolArray,
    FloatArray,
    IndexArray,
)

HOLD_S = 0.5  # [s] after a correction the heading counts as corrected: magnetometers are slower
RECOVERY_S = 10.0  # [s] in which a corrected heading comes back, as the filters' own corrections


class HeadingUncertainty:
    """Standard deviation of n headings.

    Args:
        count: The number n of sensors.
        corrected_stddev: Where a good magnetic field corrects it [rad].
        drift: By which it grows where none does [rad/s]: the gyroscope's remaining bias.

    Attributes:
        stddev: [rad], shape (n,); :data:`UNKNOWN_HEADING` until the first correction.
    """

    def __init__(self, count: int, corrected_stddev: float, drift: float) -> None:
        self.stddev: FloatArray = np.full(count, UNKNOWN_HEADING)
        self._known: NDArray[np.bool_] = np.zeros(count, dtype=bool)
        self._since_s = np.full(count, np.inf)  # the last correction
        self._corrected_stddev = corrected_stddev
        self._drift = drift

    def reset(self, index: int) -> None:
        """One sensor's heading is arbitrary again."""
        self.stddev[index] = UNKNOWN_HEADING
        self._known[index] = False
        self._since_s[index] = np.inf

    def update(self, index: IndexArray, dt: FloatArray, corrected: BoolArray) -> None:
        """Let time pass for k sensors.

        Args:
            index: Which sensors, shape (k,).
            dt: [s], shape (k,).
            corrected: Whether the magnetic field corrects the heading now, shape (k,).
        """
        known = self._known[index]
        self._since_s[index] = np.where(corrected, 0.0, self._since_s[index] + dt)
        corrected = self._since_s[index] <= HOLD_S
        stddev = self.stddev[index]
        excess = (stddev - self._corrected_stddev) * np.exp(-dt / RECOVERY_S)
        # The first correction sets a heading that was arbitrary.
        recovered = self._corrected_stddev + np.where(known, excess, 0.0)
        grown = np.where(known, stddev + self._drift * dt, UNKNOWN_HEADING)
        self.stddev[index] = np.where(corrected, recovered, np.minimum(grown, UNKNOWN_HEADING))
        self._known[index] = known | corrected
