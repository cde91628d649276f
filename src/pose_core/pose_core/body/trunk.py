"""Axes of the trunk from joint positions, the reference of all joint angles.

y = unit(left_hip − right_hip); z = the part of (neck − mid-hip) orthogonal to y, normalised;
x = y × z.
"""

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.joints import JOINT_INDEX
from pose_core.kernels.camera_geometry import compute_trunk_axes_batch

HIPS_AND_NECK = np.array([JOINT_INDEX[j] for j in ("left_hip", "right_hip", "neck")])
LEFT_HIP, RIGHT_HIP, NECK = HIPS_AND_NECK.tolist()


def mid_hip(positions: FloatArray) -> FloatArray:
    """Origin of the body frame, midway between the hips; shape (..., 15, 3) to (..., 3) [m]."""
    return 0.5 * (positions[..., LEFT_HIP, :] + positions[..., RIGHT_HIP, :])


def trunk_axes(positions: FloatArray) -> FloatArray:
    """Rotations ``R_frame_body``, whose columns are the trunk's x, y, z.

    Args:
        positions: Joint positions [m] in any frame, shape (..., 15, 3).

    Returns:
        Shape (..., 3, 3); NaN where a hip or the neck is, or where the three are collinear.
    """
    joints = np.ascontiguousarray(positions, float).reshape(-1, *positions.shape[-2:])
    axes = np.empty((len(joints), 3, 3))
    compute_trunk_axes_batch(joints, HIPS_AND_NECK, axes)
    return axes.reshape(*positions.shape[:-2], 3, 3)
