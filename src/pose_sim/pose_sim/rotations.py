"""Rotations about single axes, for many instants at once."""

import numpy as np

from pose_core.arrays import FloatArray


def about_x(angle: FloatArray) -> FloatArray:
    """Rotation matrices about x by ``angle`` [rad], shape (n,) to (n, 3, 3)."""
    return _about(0, angle)


def about_y(angle: FloatArray) -> FloatArray:
    """Rotation matrices about y by ``angle`` [rad], shape (n,) to (n, 3, 3)."""
    return _about(1, angle)


def about_z(angle: FloatArray) -> FloatArray:
    """Rotation matrices about z by ``angle`` [rad], shape (n,) to (n, 3, 3)."""
    return _about(2, angle)


def _about(axis: int, angle: FloatArray) -> FloatArray:
    # A body needs some forty of these for each of 12,000 instants: direct matrices are six times
    # faster than Rotation objects.
    first, second = (axis + 1) % 3, (axis + 2) % 3
    matrix = np.zeros((*angle.shape, 3, 3))
    cosine, sine = np.cos(angle), np.sin(angle)
    matrix[..., axis, axis] = 1.0
    matrix[..., first, first] = cosine
    matrix[..., second, second] = cosine
    matrix[..., second, first] = sine
    matrix[..., first, second] = -sine
    return matrix


def rotate(matrices: FloatArray, vectors: FloatArray) -> FloatArray:
    """Rotate vectors (..., 3) by matrices (..., 3, 3)."""
    return (matrices @ vectors[..., None])[..., 0]
