r"""Cholesky's factorisation :math:`A = U^T U` and its substitutions, in place, row by row.

For matrices of tens of rows, where calling LAPACK costs as much as the arithmetic. A matrix that is
not positive definite gives numbers that are not finite.
"""

import numpy as np

from pose_core.kernels.compiling import compiled_in_place
from pose_core.streams.samples import FloatArray


@compiled_in_place
def factorise(A: FloatArray) -> None:
    """The upper triangle of A becomes U; the lower one is left as it is and never read."""
    size = len(A)
    for i in range(size):
        pivot = A[i]
        scale = 1.0 / np.sqrt(pivot[i])
        for k in range(i, size):
            pivot[k] *= scale
        for j in range(i + 1, size):
            row, factor = A[j], pivot[j]
            for k in range(j, size):
                row[k] -= factor * pivot[k]


@compiled_in_place
def solve_lower(U: FloatArray, B: FloatArray) -> None:
    """B becomes U⁻ᵀ B."""
    for i in range(len(U)):
        row = B[i]
        for j in range(i):
            factor, above = U[j, i], B[j]
            for k in range(len(row)):
                row[k] -= factor * above[k]
        scale = 1.0 / U[i, i]
        for k in range(len(row)):
            row[k] *= scale


@compiled_in_place
def solve_upper(U: FloatArray, b: FloatArray) -> None:
    """The vector b becomes U⁻¹ b."""
    for i in range(len(U) - 1, -1, -1):
        total = b[i]
        for k in range(i + 1, len(U)):
            total -= U[i, k] * b[k]
        b[i] = total / U[i, i]
