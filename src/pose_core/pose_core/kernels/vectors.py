"""Products of vectors of three elements, without the overhead of a library."""

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.kernels.compiling import compiled_in_place


@compiled_in_place
def norm(v: FloatArray) -> float:
    """Euclidean norm."""
    return np.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])


@compiled_in_place
def dot(a: FloatArray, b: FloatArray) -> float:
    """Scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@compiled_in_place
def cross(a: FloatArray, b: FloatArray, out: FloatArray) -> None:
    """Cross product; ``out`` must be neither of the operands."""
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]
