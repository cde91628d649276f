"""A tracker that takes left for right: noticed by what is expected, and undone.

It happens when the person turns away or stands sideways, for a whole body or for the legs or arms
alone, and the joints' tracking states do not tell. :mod:`pose_core.kernels.side_swaps` does it.
"""

import numpy as np

from pose_core.joints import JOINT_INDEX, SIDES
from pose_core.kernels.side_swaps import SwapNumbers

CLEAR = 0.5  # [-] the swapped joints must lie this much nearer to what is expected
FAR = 0.12  # [m] joints that are nearer than this on average are not swapped
LIMBS = (("shoulder", "elbow", "hand"), ("hip", "knee", "foot"))
GROUPS = np.array(
    [[[JOINT_INDEX[f"{side}_{name}"] for side in SIDES] for name in names] for names in LIMBS],
    np.int64,
)
"""(groups, joints, sides): arms and legs may be swapped each for themselves."""

SWAPS = SwapNumbers(groups=GROUPS, far=FAR, clear=CLEAR)
