"""Estimation of the gyroscopes' bias while a sensor is at rest."""

import numpy as np
from numpy.typing import NDArray

from imu_bridge.filters.orientation_filter import IndexArray
from pose_core.arrays import FloatArray

REST_RATE_STDDEV = 0.05  # [rad/s] above a standing person's sway
REST_RATE_MEAN = 0.35  # [rad/s] largest bias: an MPU-9150's is up to 20 deg/s
REST_ACCELERATION_STDDEV = 0.2  # [m/s^2] detects slow rotation by gravity's direction
MEMORY_WINDOWS = 5  # [-] number of rests over which the bias is averaged


class RestBiasEstimator:
    """Bias of n gyroscopes: the mean rate over windows of rest.

    Args:
        count: The number n of sensors.
        window_s: Duration of a window [s]; 0 disables the estimation.

    Attributes:
        bias: [rad/s], shape (n, 3); zero until a sensor's first rest.
        rests: Number of windows at rest so far, shape (n,).
    """

    def __init__(self, count: int, window_s: float) -> None:
        self.bias: FloatArray = np.zeros((count, 3))
        self.rests: NDArray[np.int64] = np.zeros(count, dtype=int)
        self._window_s = window_s
        self._elapsed_s = np.zeros(count)
        self._samples = np.zeros(count)
        # Rates and accelerations (columns), relative to the window's first sample, for numerical
        # precision of the sums of squares.
        self._first = np.zeros((count, 6))
        self._sum = np.zeros((count, 6))
        self._sum_of_squares = np.zeros((count, 6))

    def restart(self, index: int) -> None:
        """Restart one sensor's window after missing samples."""
        self._elapsed_s[index] = self._samples[index] = 0.0

    def update(
        self, index: IndexArray, dt: FloatArray, rate: FloatArray, acceleration: FloatArray
    ) -> None:
        """Add a sample of each of k different sensors.

        Args:
            index: Indices of the sensors, shape (k,), without repetition.
            dt: Time since each one's previous sample [s], shape (k,).
            rate: Angular velocity [rad/s], shape (k, 3).
            acceleration: Specific force [m/s^2], shape (k, 3).
        """
        if self._window_s <= 0.0:
            return
        values = np.concatenate([rate, acceleration], axis=1)
        fresh = self._samples[index] == 0
        if fresh.any():
            new = index[fresh]
            self._first[new] = values[fresh]
            self._sum[new] = self._sum_of_squares[new] = 0.0
        relative = values - self._first[index]
        self._sum[index] += relative
        self._sum_of_squares[index] += relative * relative
        self._samples[index] += 1
        self._elapsed_s[index] += dt
        full = index[self._elapsed_s[index] >= self._window_s]
        if len(full):
            self._close(full)

    def _close(self, full: IndexArray) -> None:
        """Update the bias from complete windows at rest."""
        samples = self._samples[full, None]
        mean = self._sum[full] / samples
        variance = self._sum_of_squares[full] / samples - mean * mean
        stddev = np.sqrt(np.maximum(variance, 0.0))
        rate = mean[:, :3] + self._first[full, :3]
        at_rest = (
            (stddev[:, :3].max(axis=1) < REST_RATE_STDDEV)
            & (stddev[:, 3:].max(axis=1) < REST_ACCELERATION_STDDEV)
            & (np.abs(rate).max(axis=1) < REST_RATE_MEAN)
        )
        resting = full[at_rest]
        self.rests[resting] += 1
        share = 1.0 / np.minimum(self.rests[resting], MEMORY_WINDOWS)
        self.bias[resting] += share[:, None] * (rate[at_rest] - self.bias[resting])
        self._elapsed_s[full] = self._samples[full] = 0.0
