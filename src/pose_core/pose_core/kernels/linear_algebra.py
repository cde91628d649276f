"""Linear algebra for vectors and matrices of three rows, without the overhead of a library."""

from typing import NamedTuple

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.kernels.compiling import compiled_in_place, compiled_into_caller


@compiled_in_place
def norm(v: FloatArray | tuple[float, float, float]) -> float:
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


@compiled_in_place
def is_equal(one: FloatArray, other: FloatArray) -> bool:
    """Whether two arrays are identical."""
    is_same = True
    for k in range(len(one)):
        is_same &= one[k] == other[k]
    return is_same


class Symmetric(NamedTuple):
    """A symmetric (3, 3) matrix as scalars, so that they stay in registers."""

    xx: float
    xy: float
    xz: float
    yy: float
    yz: float
    zz: float


@compiled_in_place
def symmetric(A: FloatArray) -> Symmetric:
    """Make a symmetric matrix from an upper triangle."""
    return Symmetric(A[0, 0], A[0, 1], A[0, 2], A[1, 1], A[1, 2], A[2, 2])


@compiled_in_place
def scaled(A: Symmetric, factor: float) -> Symmetric:
    """The matrix times a factor."""
    return Symmetric(
        factor * A.xx, factor * A.xy, factor * A.xz, factor * A.yy, factor * A.yz, factor * A.zz
    )


@compiled_in_place
def add(A: Symmetric, out: FloatArray) -> None:
    """``out`` += A."""
    out[0, 0] += A.xx
    out[1, 1] += A.yy
    out[2, 2] += A.zz
    for i, k, value in ((0, 1, A.xy), (0, 2, A.xz), (1, 2, A.yz)):
        out[i, k] += value
        out[k, i] += value


@compiled_in_place
def inverse(A: Symmetric) -> Symmetric:
    """Inverse by cofactors; for well-conditioned matrices, such as covariances of a point."""
    xx, xy, xz = A.yy * A.zz - A.yz * A.yz, A.xz * A.yz - A.xy * A.zz, A.xy * A.yz - A.xz * A.yy
    yy, yz, zz = A.xx * A.zz - A.xz * A.xz, A.xy * A.xz - A.xx * A.yz, A.xx * A.yy - A.xy * A.xy
    determinant = A.xx * xx + A.xy * xy + A.xz * xz
    return scaled(Symmetric(xx, xy, xz, yy, yz, zz), 1.0 / determinant)


@compiled_into_caller
def quadratic_form(A: Symmetric, v: FloatArray) -> float:
    """vᵀ A v."""
    x, y, z = v[0], v[1], v[2]
    across = A.xy * x * y + A.xz * x * z + A.yz * y * z
    return A.xx * x * x + A.yy * y * y + A.zz * z * z + 2.0 * across
