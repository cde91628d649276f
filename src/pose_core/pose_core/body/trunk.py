"""Axes of the trunk from joint positions, the reference of all joint angles.

y = unit(left_hip − right_hip); z = the part of (neck − mid-hip) orthogonal to y, normalised;
x = y × z.
"""

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.finite_numbers import are_known
from pose_core.joints import JOINT_INDEX, JOINT_PAIRS
from pose_core.kernels.camera_geometry import compute_trunk_axes_batch

HIPS_AND_NECK = np.array([JOINT_INDEX[j] for j in ("left_hip", "right_hip", "neck")])
LEFT_HIP, RIGHT_HIP, NECK = HIPS_AND_NECK.tolist()

PAIRS = np.array(list(JOINT_PAIRS.values()))
"""(6, 2): left and right joint of each kind."""


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


def heading_axes(positions: FloatArray) -> FloatArray:
    """Rotation ``R_map_heading`` about the vertical, by the heading of the trunk, (3, 3).

    Args:
        positions: Joint positions [m] in map, shape (15, 3).

    Returns:
        NaN if the trunk is not seen.
    """
    x, y = trunk_axes(positions)[:2, 0]
    length = np.hypot(x, y)
    c, s = x / length, y / length
    zero = 0.0 * c  # NaN where the others are
    return np.array([[c, -s, zero], [s, c, zero], [zero, zero, 1.0 + zero]])


def standing_heading(positions: FloatArray) -> float:
    """Heading of a person in the neutral pose, about map's z from its x [rad].

    It is the mean over all pairs of left and right joints, since each pair has an offset of the
    tracker. NaN if no pair is seen.

    Args:
        positions: Joint positions [m] in map, shape (15, 3); NaN unseen.
    """
    lateral = positions[PAIRS[:, 0], :2] - positions[PAIRS[:, 1], :2]
    seen = are_known(lateral)
    if not seen.any():
        return float("nan")
    x, y = lateral[seen].sum(axis=0)
    return float(np.arctan2(-x, y))  # the heading is the left's direction, a quarter turn back
