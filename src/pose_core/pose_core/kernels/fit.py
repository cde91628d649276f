"""How well what a filter expects fits what it sees: what its variances are to be scaled by."""

import numpy as np

from pose_core.kernels.compiling import compiled_in_place
from pose_core.streams.samples import FloatArray

MEMORY_S = 20.0  # [s] time constant
LEAST, MOST = 0.2, 6.0  # [-] of what variances are scaled by
FITTING = 0.55  # [-] the mean squared distance that fits. It is below 3, the measurements' degrees
# of freedom, for the noise is enlarged to what slow errors leave of it.


@compiled_in_place
def note_fit(fit: FloatArray, dt_s: float, distance: float) -> None:
    """Take the mean distance of one update's joints.

    Args:
        fit: Running mean of the squared Mahalanobis distances, (1,).
        dt_s: Since the last update [s].
        distance: Of this one's joints; NaN: unseen.
    """
    if not np.isnan(distance):
        fit[0] += (1.0 - np.exp(-dt_s / MEMORY_S)) * (distance - fit[0])


@compiled_in_place
def scale_of(fit: FloatArray) -> float:
    """What variances are to be scaled by [-], see :func:`note_fit`."""
    return min(max(fit[0] / FITTING, LEAST), MOST)
