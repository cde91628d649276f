"""Factor of the published variances: the running mean of the normalised innovation squared (NIS).

Published variances are multiplied by the ratio of that mean to the one of a consistent filter.
"""

import math

MEMORY_S = 20.0  # [s] time constant of the running mean
MIN_SCALE, MAX_SCALE = 0.2, 6.0  # [-]
CONSISTENT_NIS = 0.55  # [-] mean NIS of a consistent filter. It is below 3, the measurements'
# degrees of freedom, because the noise is increased to account for correlated errors.


def updated_mean_nis(mean_nis: float, dt_s: float, nis: float) -> float:
    """The running mean after one update.

    Args:
        mean_nis: Running mean before it [-].
        dt_s: Time since the last update [s].
        nis: Mean NIS of this update's joints [-]; NaN: none observed.
    """
    if math.isnan(nis):
        return mean_nis
    return mean_nis + (1.0 - math.exp(-dt_s / MEMORY_S)) * (nis - mean_nis)


def variance_scale(mean_nis: float) -> float:
    """Factor [-] of the published variances, see :func:`updated_mean_nis`."""
    return min(max(mean_nis / CONSISTENT_NIS, MIN_SCALE), MAX_SCALE)
