"""An average adult in the N-pose: proportions of what sensors do not see."""

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.joints import JOINT_INDEX, JOINTS

NEUTRAL = {  # [m] from mid-hip, x forward, y left, z up
    "head": (0.0, 0.0, 0.75),
    "neck": (0.0, 0.0, 0.52),
    "torso": (0.0, 0.0, 0.25),
    "shoulder": (0.0, 0.18, 0.48),
    "elbow": (0.0, 0.18, 0.2),
    "hand": (0.0, 0.18, -0.05),
    "hip": (0.0, 0.09, 0.0),
    "knee": (0.0, 0.09, -0.43),
    "foot": (0.0, 0.09, -0.85),
}


def neutral_pose() -> FloatArray:
    """Joints of an average body in the N-pose, shape (15, 3) [m]."""
    joints = np.zeros((len(JOINTS), 3))
    for joint, row in JOINT_INDEX.items():
        side, _, name = joint.partition("_")
        joints[row] = NEUTRAL[name or side]
        if side == "right":
            joints[row, 1] *= -1.0
    return joints
