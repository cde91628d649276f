"""How well a filter's expectations fit, and what that says of its uncertainty.

The filter does not know how good these sensors are with this person in this light. But the
distances between what it expects and what it sees tell: their mean square, against the one that
goes with covariances that are right, scales what is published.
"""

import numpy as np

from pose_fusion.streams.samples import FloatArray

MEMORY_S = 20.0  # [s] time constant
MOST = 20.0  # [-] a squared Mahalanobis distance that counts no more than that
# Mean squared distances at which the filter's standard deviations are right. They are below 3, the
# measurements' degrees of freedom, for the noise is enlarged to what slow errors leave of it.
FITTING_KINECT = 1.3
FITTING_WITH_IMUS = 0.5
AT_FIRST = 0.5
RANGE = (0.2, 6.0)  # [-] of the variances' scale


class Surprise:
    """A running mean of squared Mahalanobis distances."""

    def __init__(self) -> None:
        self._mean = AT_FIRST

    def note(self, dt_s: float, distance: FloatArray) -> None:
        """Take the distances of one update's joints, shape (15,); NaN unseen."""
        known = distance[np.isfinite(distance)]
        if len(known) == 0:
            return
        share = 1.0 - float(np.exp(-dt_s / MEMORY_S))
        self._mean += share * (float(np.minimum(known, MOST).mean()) - self._mean)

    def variance_scale(self, has_imus: bool) -> float:
        """By what the filter's variances are to be multiplied."""
        fitting = FITTING_WITH_IMUS if has_imus else FITTING_KINECT
        return float(np.clip(self._mean / fitting, *RANGE))
