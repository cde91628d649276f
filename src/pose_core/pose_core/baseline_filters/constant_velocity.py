r"""Independent scalar Kalman filters with constant velocity.

Each channel has the state (x, ẋ) with

.. math:: F = [[1, Δt], [0, 1]], \quad Q = q [[Δt³/3, Δt²/2], [Δt²/2, Δt]], \quad H = [1, 0]

where q is the power of the white acceleration, [unit²/s³].
"""

import numpy as np

from pose_core.arrays import FloatArray

FRAME_PERIOD_S = 1.0 / 30.0  # over which standard deviations of white accelerations are defined


class ConstantVelocityFilter:
    """n independent channels.

    Args:
        values: Initial values of the channels, shape (n,).
        stddev: Initial standard deviation of the values.
        rate_stddev: Initial standard deviation of their rates [unit/s].
        acceleration_power: q of the process noise [unit²/s³], a number or one for each channel.
    """

    def __init__(
        self,
        values: FloatArray,
        stddev: float,
        rate_stddev: float,
        acceleration_power: float | FloatArray,
    ) -> None:
        n = len(values)
        self.mean = np.stack([values, np.zeros(n)], axis=1)
        self.covariance = np.tile(np.diag([stddev**2, rate_stddev**2]), (n, 1, 1))
        self._power = np.broadcast_to(np.asarray(acceleration_power, float), (n,))

    def predict(self, dt_s: float) -> None:
        """Predict by ``dt_s`` [s]."""
        F = np.array([[1.0, dt_s], [0.0, 1.0]])
        noise = np.array([[dt_s**3 / 3.0, dt_s**2 / 2.0], [dt_s**2 / 2.0, dt_s]])
        self.mean = self.mean @ F.T
        self.covariance = F @ self.covariance @ F.T + self._power[:, None, None] * noise

    def update(self, measured: FloatArray, variance: FloatArray) -> None:
        """Update with a measurement of every channel's value, shape (n,); NaN: none."""
        known = np.isfinite(measured)
        innovation = np.where(known, measured - self.mean[:, 0], 0.0)
        total = self.covariance[:, 0, 0] + variance
        gain = np.where(known[:, None], self.covariance[:, :, 0] / total[:, None], 0.0)
        self.mean = self.mean + gain * innovation[:, None]
        self.covariance = self.covariance - gain[:, :, None] * self.covariance[:, :1, :]
