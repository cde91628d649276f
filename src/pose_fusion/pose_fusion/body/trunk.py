"""The trunk's axes from joint positions, as every angle in this project is measured.

y = unit(left_hip − right_hip); z = the part of (neck − mid-hip) orthogonal to y, normalised;
x = y × z.
"""

import numpy as np

from pose_common.joints import JOINT_INDEX
from pose_fusion.streams.samples import FloatArray

LEFT_HIP, RIGHT_HIP, NECK = (JOINT_INDEX[j] for j in ("left_hip", "right_hip", "neck"))


def mid_hip(positions: FloatArray) -> FloatArray:
    """Origin of the body frame, midway between the hips; shape (..., 15, 3) to (..., 3) [m]."""
    return 0.5 * (positions[..., LEFT_HIP, :] + positions[..., RIGHT_HIP, :])


def trunk_axes(positions: FloatArray) -> FloatArray:
    """Rotations ``R_frame_body`` whose columns are the trunk's x, y, z.

    Args:
        positions: Joint positions [m] in any frame, shape (..., 15, 3).

    Returns:
        Shape (..., 3, 3); NaN where a hip or the neck is, or where the three are collinear.
    """
    lateral = positions[..., LEFT_HIP, :] - positions[..., RIGHT_HIP, :]
    up = positions[..., NECK, :] - mid_hip(positions)
    with np.errstate(invalid="ignore", divide="ignore"):
        y = lateral / np.linalg.norm(lateral, axis=-1, keepdims=True)
        z = up - np.sum(up * y, axis=-1, keepdims=True) * y
        z = z / np.linalg.norm(z, axis=-1, keepdims=True)
    return np.stack([np.cross(y, z), y, z], axis=-1)
