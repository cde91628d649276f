r"""The fresh part of an axis: what IMU and cameras see of it, less most of its recent mean.

What cameras see wrongly of a limb stays alike for some tenths of a second, in which a moving limb
turns far. Were such an error an Ornstein-Uhlenbeck process of time constant :math:`\tau`, then it
is white in :math:`a - (1 - T/\tau)\,\bar a`, where :math:`\bar a` is the mean over the last T, up
to frequencies of :math:`1/(2\pi T)`: there its samples count one by one, and what is compared of a
limb at rest is little, as it should be.
"""

import numpy as np

from pose_core.kernels.compiling import compiled_in_place
from pose_core.streams.samples import FloatArray

MEAN_S = 0.1  # [s] T
RECENT_SHARE = 0.7  # [-] of the mean that is taken off: τ is a third of a second
UNSEEN_S = 0.15  # [s] after which the mean begins anew


@compiled_in_place
def take_fresh_part(
    recent: FloatArray,
    elapsed_s: float,
    axis_world: FloatArray,
    axis_map: FloatArray,
    fresh: FloatArray,
) -> float:
    """Tell the fresh part of an axis and take the axis into the mean.

    Args:
        recent: The recent mean as the IMU and as the cameras see it, (2, 3); is updated.
        elapsed_s: Time since it was updated last [s].
        axis_world: The axis in the IMU's world, (3,).
        axis_map: The axis in map as the cameras see it, (3,).
        fresh: Filled: its fresh part in either, (2, 3).

    Returns:
        The rate at which the axis turns [rad/s]; NaN where there is no recent mean.
    """
    is_new, moved = elapsed_s > UNSEEN_S, 0.0
    taken = 1.0 if is_new else 1.0 - np.exp(-elapsed_s / MEAN_S)
    for k in range(3):
        in_world, in_map = axis_world[k] - recent[0, k], axis_map[k] - recent[1, k]
        moved += in_world * in_world
        fresh[0, k] = axis_world[k] - RECENT_SHARE * recent[0, k]
        fresh[1, k] = axis_map[k] - RECENT_SHARE * recent[1, k]
        recent[0, k] += taken * in_world
        recent[1, k] += taken * in_map
    return np.nan if is_new else np.sqrt(moved) / MEAN_S
