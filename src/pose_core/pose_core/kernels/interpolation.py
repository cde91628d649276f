"""Orientation interpolated between two samples, or integrated from one by an angular rate."""

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.kernels.compiling import compiled_in_place, compiled_into_caller
from pose_core.kernels.rotations import matrix_of_quaternion, rotate_right, vector_scale


@compiled_in_place
def interpolate(first: FloatArray, second: FloatArray, share: float, out: FloatArray) -> None:
    """Spherical linear interpolation of two orientations (x, y, z, w), as a rotation matrix.

    Args:
        first: At share 0.
        second: At share 1.
        share: Position between the two, 0 to 1 [-].
        out: (3, 3).
    """
    # conj(first) second, scaled by the product of their norms
    x, y, z, w = -first[0], -first[1], -first[2], first[3]
    a = w * second[0] + x * second[3] + y * second[2] - z * second[1]
    b = w * second[1] - x * second[2] + y * second[3] + z * second[0]
    c = w * second[2] + x * second[1] - y * second[0] + z * second[3]
    d = w * second[3] - x * second[0] - y * second[1] - z * second[2]
    length = np.sqrt(a * a + b * b + c * c + d * d)
    scale = share * vector_scale(a / length, b / length, c / length, d / length) / length
    rotated_right(first, scale * a, scale * b, scale * c, out)


@compiled_into_caller
def rotated_right(orientation: FloatArray, x: float, y: float, z: float, out: FloatArray) -> None:
    """Rotation matrix of an orientation (x, y, z, w) times exp of a body-fixed vector [rad]."""
    matrix_of_quaternion(orientation, out)
    rotate_right(x, y, z, out)
