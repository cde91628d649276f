"""Linear algebra for matrices of up to three rows, in place, without the overhead of a library."""

from typing import NamedTuple

import numpy as np

from pose_core.kernels.compiling import compiled_in_place
from pose_core.streams.samples import FloatArray


@compiled_in_place
def solve(A: FloatArray, B: FloatArray, size: int) -> None:
    """Replace B by A⁻¹ B, and the symmetric positive definite A by its Cholesky factor.

    Args:
        A: Only the first ``size`` rows and columns are used.
        B: Only the first ``size`` rows are used; any number of columns.
        size: At most the number of rows.
    """
    for i in range(size):
        for j in range(i + 1):
            total = A[i, j]
            for k in range(j):
                total -= A[i, k] * A[j, k]
            A[i, j] = np.sqrt(total) if i == j else total / A[j, j]
    for column in range(B.shape[1]):
        for i in range(size):
            for k in range(i):
                B[i, column] -= A[i, k] * B[k, column]
            B[i, column] /= A[i, i]
        for i in range(size - 1, -1, -1):
            for k in range(i + 1, size):
                B[i, column] -= A[k, i] * B[k, column]
            B[i, column] /= A[i, i]


@compiled_in_place
def mirror(A: FloatArray) -> None:
    """Copy the upper triangle of a square matrix to the lower one."""
    for i in range(len(A)):
        for j in range(i):
            A[i, j] = A[j, i]


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
def inverse(A: Symmetric) -> Symmetric:
    """Inverse by cofactors; for well-conditioned matrices, such as covariances of a point."""
    xx, xy, xz = A.yy * A.zz - A.yz * A.yz, A.xz * A.yz - A.xy * A.zz, A.xy * A.yz - A.xz * A.yy
    yy, yz, zz = A.xx * A.zz - A.xz * A.xz, A.xy * A.xz - A.xx * A.yz, A.xx * A.yy - A.xy * A.xy
    determinant = A.xx * xx + A.xy * xy + A.xz * xz
    return scaled(Symmetric(xx, xy, xz, yy, yz, zz), 1.0 / determinant)


@compiled_in_place
def quadratic_form(A: Symmetric, v: FloatArray) -> float:
    """vᵀ A v."""
    x, y, z = v[0], v[1], v[2]
    across = A.xy * x * y + A.xz * x * z + A.yz * y * z
    return A.xx * x * x + A.yy * y * y + A.zz * z * z + 2.0 * across
