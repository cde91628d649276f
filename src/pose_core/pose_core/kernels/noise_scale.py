"""Variance calibration: the running mean of the normalised innovation squared (NIS).

Published variances are multiplied by the ratio of that mean to the one of a consistent filter.
"""

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.kernels.compiling import compiled_in_place

MEMORY_S = 20.0  # [s] time constant of the running mean
MIN_SCALE, MAX_SCALE = 0.2, 6.0  # [-]
CONSISTENT_NIS = 0.55  # [-] mean NIS of a consistent filter. It is below 3, the measurements'
# degrees of freedom, because the noise is increased to account for correlated errors.


@compiled_in_place
def update_mean_nis(mean_nis: FloatArray, dt_s: float, nis: float) -> None:
    """Update the running mean, (1,), by one update's NIS.

    Args:
        mean_nis: Running mean [-], (1,).
        dt_s: Time since the last update [s].
        nis: Mean NIS of this update's joints [-]; NaN: none observed.
    """
    if not np.isnan(nis):
        mean_nis[0] += (1.0 - np.exp(-dt_s / MEMORY_S)) * (nis - mean_nis[0])


@compiled_in_place
def variance_scale(mean_nis: FloatArray) -> float:
    """Factor [-] of the published variances, see :func:`update_mean_nis`."""
    return min(max(mean_nis[0] / CONSISTENT_NIS, MIN_SCALE), MAX_SCALE)
