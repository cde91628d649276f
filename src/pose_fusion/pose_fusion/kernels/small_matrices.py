"""Linear algebra of matrices of up to three rows, in place and without a library's overhead."""

import numpy as np

from pose_fusion.kernels.compiling import compiled
from pose_fusion.streams.samples import FloatArray


@compiled
def solve(A: FloatArray, B: FloatArray, size: int) -> None:
    """B becomes A⁻¹ B by Cholesky's method; A, symmetric and positive, becomes its factor.

    Args:
        A: Its first ``size`` rows and columns count.
        B: Its first ``size`` rows count; any number of columns.
        size: At most the matrices' rows.
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


@compiled
def mirror(A: FloatArray) -> None:
    """Make a square matrix symmetric: its upper triangle counts."""
    for i in range(len(A)):
        for j in range(i):
            A[i, j] = A[j, i]
