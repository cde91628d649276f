r"""Cholesky's factorisation :math:`A = U^T U` and its substitutions, in place, row by row.

For matrices with tens of rows, for which a call of LAPACK costs as much as the arithmetic. A matrix
that is not positive definite results in values that are not finite.
"""

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.kernels.compiling import compiled_in_place, compiled_into_caller


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
    """Replace B by U⁻ᵀ B: two rows at a time, so that those above are read half as often."""
    for i in range(0, len(U) - 1, 2):
        subtract_above_two(U, i, B)
        one, two, factor = B[i], B[i + 1], U[i, i + 1]
        scale, next_scale = 1.0 / U[i, i], 1.0 / U[i + 1, i + 1]
        for k in range(len(one)):
            one[k] *= scale
            two[k] = (two[k] - factor * one[k]) * next_scale
    if len(U) % 2 == 1:
        last = len(U) - 1
        subtract_above(U, last, B, 0)
        row, scale = B[last], 1.0 / U[last, last]
        for k in range(len(row)):
            row[k] *= scale


@compiled_into_caller
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


@compiled_into_caller
def subtract_above_two(U: FloatArray, i: int, B: FloatArray) -> None:
    """As :func:`subtract_above`, the rows above i from the rows i and i + 1, i being even."""
    one, two, whole = B[i], B[i + 1], i - i % 4
    for j in range(0, whole, 4):
        a, b, c, d = U[j, i], U[j + 1, i], U[j + 2, i], U[j + 3, i]
        e, f, g, h = U[j, i + 1], U[j + 1, i + 1], U[j + 2, i + 1], U[j + 3, i + 1]
        first, second, third, fourth = B[j], B[j + 1], B[j + 2], B[j + 3]
        for k in range(len(one)):
            w, x, y, z = first[k], second[k], third[k], fourth[k]
            one[k] -= a * w + b * x + c * y + d * z
            two[k] -= e * w + f * x + g * y + h * z
    for j in range(whole, i):
        a, e, above = U[j, i], U[j, i + 1], B[j]
        for k in range(len(one)):
            one[k] -= a * above[k]
            two[k] -= e * above[k]


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
