"""Flexion of a hinge, and the swing-twist decomposition of a link's rotation in its parent."""

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.kernels.compiling import compiled_in_place


@compiled_in_place
def flexion(R_parent_link: FloatArray, sign: float) -> float:
    """A hinge's flexion [rad], negative when it bends backwards."""
    R = R_parent_link
    return sign * np.arctan2(R[0, 2] - R[2, 0], R[0, 0] + R[2, 2])


@compiled_in_place
def twist(R_parent_link: FloatArray) -> tuple[float, float]:
    """Twist of a link about its own z axis.

    Args:
        R_parent_link: Shape (3, 3).

    Returns:
        The twist [rad], and how well it is defined, from 0 (swung by half a turn) to 1.
    """
    R = R_parent_link
    angle = np.arctan2(R[1, 0] - R[0, 1], R[0, 0] + R[1, 1])
    return angle, min(max(0.5 * (1.0 + R[2, 2]), 0.0), 1.0)
