"""Pitch and yaw of limbs in ``map``: what zhang2015's figures 8 and 9 show.

With d the direction of a limb from its upper to its lower joint: pitch = asin(d_z), −90° where it
hangs down; yaw = atan2(d_y, d_x), which says nothing where the limb is nearly upright.
"""

import numpy as np

from pose_core.joints import JOINT_INDEX
from pose_core.streams.samples import FloatArray
from pose_evaluation.stability import BONES

LIMBS: tuple[str, ...] = tuple(
    f"{side}_{bone}"
    for bone in ("upper_arm", "forearm", "thigh", "shank")
    for side in ("left", "right")
)
STEEP = np.radians(75.0)  # [rad] of pitch, beyond which the yaw is noise


def limb_attitude(positions: FloatArray, limb: str) -> tuple[FloatArray, FloatArray]:
    """Pitch and yaw [rad] of a limb, shape (n,) each; NaN where unknown.

    Args:
        positions: Joint positions [m] in ``map``, shape (n, 15, 3).
        limb: One of :data:`LIMBS`.

    Returns:
        Pitch in [−π/2, π/2]; yaw in (−π, π], NaN where the limb is steeper than 75°.
    """
    top, end = BONES[limb]
    bone = positions[:, JOINT_INDEX[end]] - positions[:, JOINT_INDEX[top]]
    with np.errstate(invalid="ignore", divide="ignore"):
        direction = bone / np.linalg.norm(bone, axis=1, keepdims=True)
        pitch = np.arcsin(np.clip(direction[:, 2], -1.0, 1.0))
        yaw = np.arctan2(direction[:, 1], direction[:, 0])
        yaw = np.where(np.abs(pitch) > STEEP, np.nan, yaw)
    return pitch, np.asarray(yaw)
