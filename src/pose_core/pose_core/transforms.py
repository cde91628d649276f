"""Rigid transforms as matrices: application to points, inverse."""

import numpy as np

from pose_core.streams.samples import FloatArray


def transformed(T_target_source: FloatArray, points: FloatArray) -> FloatArray:
    """Transform points [m], shape (..., 3), to another frame."""
    return points @ T_target_source[:3, :3].T + T_target_source[:3, 3]


def inverse(T_target_source: FloatArray) -> FloatArray:
    """``T_source_target`` of a rigid transform, shape (4, 4)."""
    R = T_target_source[:3, :3]
    T = np.eye(4)
    T[:3, :3] = R.T
    T[:3, 3] = -R.T @ T_target_source[:3, 3]
    return T
