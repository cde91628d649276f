r"""Measurement noise from the data, and the sensors' weighted mean: li2020 (12) to (15).

A sample near the filter's prediction gets a small noise, one far from it a large noise:
:math:`v_j = 1/p(z_j) = \sqrt{2\pi}\,\sigma_j \exp(d_j^2 / 2\sigma_j^2)`, read in metres.
"""

import numpy as np

from pose_core.arrays import FloatArray

MAX_NOISE = 1e3  # [m] practically no information, but finite
MAX_EXPONENT = float(np.log(MAX_NOISE))


def measurement_noise(
    measured: FloatArray, predicted: FloatArray, predicted_variance: FloatArray
) -> FloatArray:
    """Noise variances R_jj of each sensor's measurement.

    Args:
        measured: z of each sensor, shape (sensors, m) [m]; NaN where not measured.
        predicted: u_z, shape (m,) [m].
        predicted_variance: The diagonal of Σ wᶜ (Z−u)(Z−u)ᵀ, shape (m,) [m²].

    Returns:
        Shape (sensors, m) [m²]; infinite where not measured.
    """
    deviation = measured - predicted
    exponent = np.minimum(deviation**2 / (2.0 * predicted_variance), MAX_EXPONENT)
    v = np.sqrt(2.0 * np.pi * predicted_variance) * np.exp(exponent)  # li2020 (12)
    return np.where(np.isfinite(deviation), v**2, np.inf)  # li2020 (13)


def fuse_measurements(
    measured: FloatArray, noise: FloatArray, predicted: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Combine the sensors by the inverse of their noise, for any number of sensors.

    Args:
        measured: Shape (sensors, m) [m].
        noise: Variances, shape (sensors, m) [m²]; infinite where not measured.
        predicted: Values used where no sensor measured, shape (m,) [m].

    Returns:
        z, shape (m,) [m], and the diagonal of R, shape (m,) [m²].
    """
    information = 1.0 / noise
    total = np.sum(information, axis=0)
    seen = total > 0.0
    R = np.where(seen, 1.0 / np.where(seen, total, 1.0), MAX_NOISE**2)  # li2020 (14)
    weighted = np.sum(information * np.where(noise < np.inf, measured, 0.0), axis=0)
    return np.where(seen, R * weighted, predicted), R  # li2020 (15)
