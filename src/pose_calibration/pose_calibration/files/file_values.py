"""Conversion of mappings, numbers and rotations to and from a session's file."""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from pose_core.api import FloatArray, matrix_of_quaternion, quaternion as quaternion_of
from pose_core.errors import InputError
from pose_core.finite_numbers import finite_numbers

UNIT_TOLERANCE = 1e-3  # [-] of a quaternion's norm, for numbers rounded by hand


def rounded(value: float, digits: int) -> float:
    """Round a number; never to a negative zero."""
    return round(float(value), digits) + 0.0


def rounded_list(values: Iterable[float], digits: int) -> list[float]:
    """Round several numbers."""
    return [rounded(value, digits) for value in values]


def quaternion_values(R: FloatArray, digits: int) -> list[float]:
    """A rotation, (3, 3), as a quaternion x, y, z, w with a unique sign."""
    quaternion = np.empty(4)
    quaternion_of(np.ascontiguousarray(R, float), quaternion)
    return rounded_list(quaternion, digits)


def read_mapping(what: str, value: Any, expected: str = "a mapping") -> Mapping[Any, Any]:
    """A mapping from a file.

    Raises:
        InputError: If it is something else.
    """
    if not isinstance(value, Mapping):
        raise InputError(f"{what} is {value!r}, expected {expected}")
    return value


def read_vector(what: str, value: Any, count: int) -> FloatArray:
    """Numbers from a file.

    Args:
        what: Name of the value in the message.
        value: The file's value.
        count: Expected count of numbers.

    Raises:
        InputError: If it is not such a list.
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
