"""A tracker that takes left for right: noticed by what is expected, and undone.

It happens when the person turns away or stands sideways, for a whole body or for the legs or arms
alone, and the joints' tracking states do not tell.
"""

import numpy as np
from numpy.typing import NDArray

from pose_common.joints import JOINT_INDEX, SIDES
from pose_fusion.body.segment_tree import SegmentTree
from pose_fusion.kernels.placing import Pose
from pose_fusion.kernels.side_swaps import unswap_cameras
from pose_fusion.streams.samples import FloatArray

CLEAR = 0.5  # [-] the swapped joints must lie this much nearer to what is expected
FAR = 0.12  # [m] joints that are nearer than this on average are not swapped
LIMBS = (("shoulder", "elbow", "hand"), ("hip", "knee", "foot"))
GROUPS = np.array(
    [[[JOINT_INDEX[f"{side}_{name}"] for side in SIDES] for name in names] for names in LIMBS]
)
"""(groups, joints, sides): arms and legs may be swapped each for themselves."""


def unswapped(
    tree: SegmentTree, pose: Pose, seen: FloatArray, tracking_state: NDArray[np.uint8]
) -> tuple[FloatArray, NDArray[np.uint8], int]:
    """The joints of all sensors, in the order that fits what is expected.

    Args:
        tree: The body.
        pose: The pose that is expected.
        seen: Joint positions [m], shape (sensors, 15, 3); NaN unseen.
        tracking_state: Shape (sensors, 15).

    Returns:
        Positions and states as they are to be taken, and how many groups (arms, legs) had been
        swapped.
    """
    positions, states = seen.copy(), tracking_state.copy()
    swaps = unswap_cameras(tree.numbers, pose, GROUPS, FAR, CLEAR, positions, states)
    return positions, states, swaps
