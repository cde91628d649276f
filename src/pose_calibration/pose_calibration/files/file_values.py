"""Numbers and rotations as a session's file holds them."""

from typing import Any

import numpy as np

from pose_core.errors import InputError
from pose_core.finite_numbers import finite_numbers
from pose_core.kernels.rotations import matrix_of_quaternion
from pose_core.kernels.rotations import quaternion as quaternion_of
from pose_core.streams.samples import FloatArray

UNIT_TOLERANCE = 1e-3  # [-] of a quaternion's length, for numbers rounded by hand


def rounded(value: float, digits: int) -> float:
    """A number short enough for people; never a negative zero."""
    return round(float(value), digits) + 0.0


def quaternion_values(R: FloatArray, digits: int) -> list[float]:
    """A rotation as the quaternion x, y, z, w: of the two that mean the same, one."""
    quaternion = np.empty(4)
    quaternion_of(np.ascontiguousarray(R, float), quaternion)
    return [rounded(value, digits) for value in quaternion]


def read_vector(what: str, value: Any, count: int) -> FloatArray:
    """Numbers from a file.

    Args:
        what: Names the value in the message.
        value: What the file has.
        count: How many numbers it must be.

    Raises:
        InputError: If it is anything else.
    """
    numbers = finite_numbers(value, count)
    if numbers is None:
        raise InputError(f"{what} is {value!r}, expected {count} numbers")
    return numbers


def read_rotation(what: str, value: Any) -> FloatArray:
    """A rotation matrix, (3, 3), from a file's quaternion x, y, z, w.

    Raises:
        InputError: If it is no unit quaternion.
    """
    quaternion = read_vector(what, value, 4)
    length = float(np.linalg.norm(quaternion))
    if abs(length - 1.0) > UNIT_TOLERANCE:
        raise InputError(f"{what} has length {length:.4f}, expected a unit quaternion x, y, z, w")
    R = np.empty((3, 3))
    matrix_of_quaternion(quaternion, R)
    return R
