"""Detection of magnetic disturbances by iron and magnets.

The strength and dip of the earth's field do not depend on the sensor's rotation. A field whose
strength and dip stay constant while the sensor rotates becomes the reference; a field that deviates
from the reference is disturbed.

References:
    Laidig, Seel (2023), Information Fusion 91, doi:10.1016/j.inffus.2022.10.014, section 3.6:
    detection of disturbances by norm and dip, acceptance of a new homogeneous field.
"""

import numpy as np
from numpy.typing import NDArray

from imu_bridge.filters.orientation_filter import BoolArray, IndexArray
from pose_core.arrays import FloatArray

STRENGTH_TOLERANCE = 0.1  # [-] of the reference
DIP_TOLERANCE = np.radians(10.0)  # [rad]
SMOOTHING_S = 0.05  # [s] time constant against the magnetometer's noise
REFERENCE_S = 20.0  # [s] time constant of the reference
CLEAR_S = 0.5  # [s] of agreement before a field is accepted again
NEW_FIRST_S = 5.0  # [s] of constancy under rotation before a first reference is accepted
NEW_S = 20.0  # [s] the same for a different reference later
TURNING = np.radians(20.0)  # [rad/s] above it the sensor rotates


class FieldCheck:
    """Checks the magnetic fields at n sensors.

    Attributes:
        verified: Whether a sensor has a reference field, shape (n,).
    """

    def __init__(self, count: int) -> None:
        self.verified: NDArray[np.bool_] = np.zeros(count, dtype=bool)
        # Strength in its own unit and dip [rad], shape (n, 2).
        self._smoothed = np.full((count, 2), np.nan)
        self._reference = np.full((count, 2), np.nan)
        self._candidate = np.full((count, 2), np.nan)
        self._candidate_s = np.zeros(count)
        self._clear_s = np.zeros(count)
        self._since_s = np.zeros(count)  # [s] since the sensor's last field

    def reset(self, index: int) -> None:
        """Reset one sensor."""
        self.verified[index] = False
        for values in (self._smoothed, self._reference, self._candidate):
            values[index] = np.nan
        self._candidate_s[index] = self._clear_s[index] = self._since_s[index] = 0.0

    def update(
        self, index: IndexArray, dt: FloatArray, field_world: FloatArray, turn_rate: FloatArray
    ) -> BoolArray:
        """Check a sample of each of k sensors.

        Args:
            index: Indices of the sensors, shape (k,), without repetition.
            dt: Time since each one's previous sample [s], shape (k,).
            field_world: The field in axes with z up, shape (k, 3); NaN if there is none.
            turn_rate: The norm of the angular velocity [rad/s], shape (k,).

        Returns:
            Whether each field is accepted; all are before a sensor has a reference.
        """
        believed = np.zeros(len(index), dtype=bool)
        self._since_s[index] += dt
        rows = np.isfinite(field_world).all(axis=1)
        believed[rows] = self._judge(index[rows], field_world[rows], turn_rate[rows])
        return believed

    def _judge(
        self, index: IndexArray, field_world: FloatArray, turn_rate: FloatArray
    ) -> BoolArray:
        dt = self._since_s[index]
        self._since_s[index] = 0.0
        horizontal = np.hypot(field_world[:, 0], field_world[:, 1])
        strength = np.hypot(horizontal, field_world[:, 2])
        now = np.stack([strength, -np.arctan2(field_world[:, 2], horizontal)], axis=1)
        before = self._smoothed[index]
        smoothed = np.where(
            np.isnan(before), now, before + _share(dt, SMOOTHING_S) * (now - before)
        )
        self._smoothed[index] = smoothed
        reference = self._reference[index]
        near = _alike(smoothed, reference)
        self._clear_s[index] = np.where(near, self._clear_s[index] + dt, 0.0)
        clear: BoolArray = self._clear_s[index] >= CLEAR_S
        followed = reference + _share(dt, REFERENCE_S) * (smoothed - reference)
        self._reference[index] = np.where(clear[:, None], followed, reference)
        self._consider(index, dt, smoothed, turn_rate)
        return clear | ~self.verified[index]

    def _consider(
        self, index: IndexArray, dt: FloatArray, smoothed: FloatArray, turn_rate: FloatArray
    ) -> None:
        """Accept a field as the reference if it stays constant while the sensor rotates."""
        candidate = self._candidate[index]
        same = _alike(smoothed, candidate)
        followed = candidate + _share(dt, REFERENCE_S) * (smoothed - candidate)
        self._candidate[index] = np.where(same[:, None], followed, smoothed)
        turned_s = self._candidate_s[index] + np.where(turn_rate > TURNING, dt, 0.0)
        elapsed_s = np.where(same, turned_s, 0.0)
        self._candidate_s[index] = elapsed_s
        accepted = index[elapsed_s >= np.where(self.verified[index], NEW_S, NEW_FIRST_S)]
        self._reference[accepted] = self._candidate[accepted]
        self._candidate_s[accepted] = 0.0
        self._clear_s[accepted] = CLEAR_S
        self.verified[accepted] = True


def _share(dt: FloatArray, tau_s: float) -> FloatArray:
    """Gain of a first-order low-pass for each time step, shape (k, 1)."""
    return -np.expm1(-dt / tau_s)[:, None]


def _alike(field: FloatArray, reference: FloatArray) -> BoolArray:
    """Whether strengths and dips agree; False without a reference."""
    difference = np.abs(field - reference)
    alike: BoolArray = (difference[:, 0] < STRENGTH_TOLERANCE * reference[:, 0]) & (
        difference[:, 1] < DIP_TOLERANCE
    )
    return alike
