r"""Cholesky's factorisation :math:`A = U^T U` and its substitutions, in place, row by row.

For matrices with tens of rows, for which a call of LAPACK costs as much as the arithmetic. A matrix
that is not positive definite results in values that are not finite.
"""

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.kernels.compiling import compiled_in_place


@compiled_in_place
def factorise(A: FloatArray) -> None:
    """Replace the upper triangle of A by U; the lower one is neither read nor changed."""
    for i in range(len(A)):
        subtract_above(A, i, A, i)
        row, scale = A[i, i:], 1.0 / np.sqrt(A[i, i])
        for k in range(len(row)):
            row[k] *= scale


@compiled_in_place
def solve_lower(U: FloatArray, B: FloatArray) -> None:
    """Replace B by U⁻ᵀ B."""
    for i in range(len(U)):
        subtract_above(U, i, B, 0)
        row, scale = B[i], 1.0 / U[i, i]
        for k in range(len(row)):
            row[k] *= scale


@compiled_in_place
def subtract_above(U: FloatArray, i: int, B: FloatArray, start: int) -> None:
    """Subtract Uⱼᵢ Bⱼ of all rows j above from row i of B, from one column on.

    Four rows are processed together, so that row i is read and written less often. Only loops that
    begin at zero are vectorised: an index from elsewhere might be negative.
    """
    row, whole = B[i, start:], i - i % 4
    for j in range(0, whole, 4):
        a, b, c, d = U[j, i], U[j + 1, i], U[j + 2, i], U[j + 3, i]
        first, second = B[j, start:], B[j + 1, start:]
        third, fourth = B[j + 2, start:], B[j + 3, start:]
        for k in range(len(row)):
            row[k] -= a * first[k] + b * second[k] + c * third[k] + d * fourth[k]
    for j in range(whole, i):
        factor, above = U[j, i], B[j, start:]
        for k in range(len(row)):
            row[k] -= factor * above[k]


@compiled_in_place
def solve_vector(U: FloatArray, b: FloatArray) -> None:
    """Replace the vector b by U⁻¹ U⁻ᵀ b."""
    size = len(U)
    for i in range(size):
        row = U[i]
        b[i] /= row[i]
        for k in range(i + 1, size):
            b[k] -= row[k] * b[i]
    for i in range(size - 1, -1, -1):
        row, total = U[i], b[i]
        for k in range(i + 1, size):
            total -= row[k] * b[k]
        b[i] = total / row[i]
