"""A tracker that takes left for right: noticed by what is expected, and undone.

It happens when the person turns away or stands sideways, for a whole body or for the legs or arms
alone, and the joints' tracking states do not tell.
"""

import numpy as np
from numpy.typing import NDArray

from pose_common.joints import JOINT_INDEX, JOINTS, SIDES
from pose_fusion.kernels.side_swaps import unswap
from pose_fusion.streams.samples import FloatArray

CLEAR = 0.5  # [-] the swapped joints must lie this much nearer to what is expected
FAR = 0.12  # [m] joints that are nearer than this on average are not swapped
LIMBS = (("shoulder", "elbow", "hand"), ("hip", "knee", "foot"))
GROUPS = np.array(
    [[[JOINT_INDEX[f"{side}_{name}"] for side in SIDES] for name in names] for names in LIMBS]
)
"""(groups, joints, sides): arms and legs may be swapped each for themselves."""


def unswapped(seen: FloatArray, expected: FloatArray) -> tuple[NDArray[np.int_], int]:
    """The order of a sensor's joints that fits what is expected.

    Args:
        seen: Joint positions of one sensor [m], shape (15, 3); NaN unseen.
        expected: Where the joints should be [m], shape (15, 3).

    Returns:
        For each joint, the index of the seen joint that it is, shape (15,), and how many groups
        (arms, legs) had been swapped.
    """
    order = np.arange(len(JOINTS))
    return order, unswap(seen, expected, GROUPS, FAR, CLEAR, order)
