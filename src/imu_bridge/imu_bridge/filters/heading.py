"""Uncertainty of the headings: reduced by magnetometers, growing by gyroscope drift."""

import numpy as np
from numpy.typing import NDArray

from pose_core.arrays import FloatArray

UNKNOWN_HEADING = np.pi  # [rad] standard deviation of an unknown heading
HOLD_S = 0.5  # [s] for which a correction is valid: magnetometers are slower than gyroscopes
RECOVERY_S = 10.0  # [s] time constant of a correction, as in the filters


class HeadingUncertainty:
    """Standard deviation of n headings.

    Args:
        count: The number n of sensors.
        corrected_stddev: Value while an undisturbed magnetic field corrects it [rad].
        drift: Growth without correction [rad/s], from the gyroscope's remaining bias.

    Attributes:
        stddev: [rad], shape (n,); :data:`UNKNOWN_HEADING` until the first correction.
    """

    def __init__(self, count: int, corrected_stddev: float, drift: float) -> None:
        self.stddev: FloatArray = np.full(count, UNKNOWN_HEADING)
        self._known: NDArray[np.bool_] = np.zeros(count, dtype=bool)
        self._since_s = np.full(count, np.inf)  # [s] since the last correction
        self._corrected_stddev = corrected_stddev
        self._drift = drift

    def reset(self, index: int) -> None:
        """Set one sensor's heading to unknown."""
        self.stddev[index] = UNKNOWN_HEADING
        self._known[index] = False
        self._since_s[index] = np.inf

    def update(self, index: NDArray[np.intp], dt: FloatArray, corrected: NDArray[np.bool_]) -> None:
        """Advance the time of k sensors.

        Args:
            index: Indices of the sensors, shape (k,).
            dt: [s], shape (k,).
            corrected: Whether the magnetic field corrects the heading now, shape (k,).
        """
        known = self._known[index]
        self._since_s[index] = np.where(corrected, 0.0, self._since_s[index] + dt)
        corrected = self._since_s[index] <= HOLD_S
        stddev = self.stddev[index]
        excess = (stddev - self._corrected_stddev) * np.exp(-dt / RECOVERY_S)
        # The first correction initialises the heading.
        recovered = self._corrected_stddev + np.where(known, excess, 0.0)
        grown = np.where(known, stddev + self._drift * dt, UNKNOWN_HEADING)
        self.stddev[index] = np.where(corrected, recovered, np.minimum(grown, UNKNOWN_HEADING))
        self._known[index] = known | corrected
