"""Whether a magnetic field looks like the earth's, or like iron and magnets near by.

The earth's field has the same strength and dip wherever the sensor turns. A field that keeps both
while the sensor turns becomes the reference; one that leaves them is disturbed.

References:
    Laidig, Seel (2023), Information Fusion 91, doi:10.1016/j.inffus.2022.10.014, section 3.6:
    detection of disturbances by norm and dip, acceptance of a new homogeneous field.
"""

import numpy as np
from numpy.typing import NDArray

from imu_bridge.filters.orientation_filter import BoolArray, FloatArray, IndexArray

STRENGTH_TOLERANCE = 0.1  # [-] of the reference
DIP_TOLERANCE = np.radians(10.0)  # [rad]
SMOOTHING_S = 0.05  # [s] time constant against the magnetometer's noise
REFERENCE_S = 20.0  # [s] time constant in which the reference follows
CLEAR_S = 0.5  # [s] that a field must look right before it is believed again
NEW_FIRST_S = 5.0  # [s] that a first field must stay the same while the sensor turns
NEW_S = 20.0  # [s] and a later, different one
TURNING = np.radians(20.0)  # [rad/s] above it the sensor turns


class FieldCheck:
    """Judges the magnetic fields at n sensors.

    Args:
        count: The number n of sensors.

    Attributes:
        verified: Whether a sensor's field has ever stayed the same while it turned, shape (n,).
    """

    def __init__(self, count: int) -> None:
        self.verified: NDArray[np.bool_] = np.zeros(count, dtype=bool)
        # Strength in its own unit and dip [rad], shape (n, 2).
        self._smoothed = np.full((count, 2), np.nan)
        self._reference = np.full((count, 2), np.nan)
        self._candidate = np.full((count, 2), np.nan)
        self._candidate_s = np.zeros(count)
        self._clear_s = np.zeros(count)
        self._since_s = np.zeros(count)  # the sensor's last field

    def reset(self, index: int) -> None:
        """Forget what one sensor has measured."""
        self.verified[index] = False
        for values in (self._smoothed, self._reference, self._candidate):
            values[index] = np.nan
        self._candidate_s[index] = self._clear_s[index] = self._since_s[index] = 0.0

    def update(
        self, index: IndexArray, dt: FloatArray, field_world: FloatArray, turn_rate: FloatArray
    ) -> BoolArray:
        """Judge a sample of each of k sensors.

        Args:
            index: Which sensors, shape (k,), without repetition.
            dt: Time since each one's previous sample [s], shape (k,).
            field_world: The field in axes with z up, shape (k, 3); NaN: there is none.
            turn_rate: The norm of the angular velocity [rad/s], shape (k,).

        Returns:
            Whether each field can be believed; before one is verified, all are.
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
        """Accept a field as the reference that stays the same while the sensor turns."""
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
    """How much of a difference a first-order low-pass takes in, shape (k, 1)."""
    return -np.expm1(-dt / tau_s)[:, None]


def _alike(field: FloatArray, reference: FloatArray) -> BoolArray:
    """Whether strengths and dips agree; false where there is no reference."""
    difference = np.abs(field - reference)
    alike: BoolArray = (difference[:, 0] < STRENGTH_TOLERANCE * reference[:, 0]) & (
        difference[:, 1] < DIP_TOLERANCE
    )
    return alike
