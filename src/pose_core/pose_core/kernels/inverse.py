r"""The inverse of a covariance: by halves, since products of matrices are what a CPU is best at.

.. math::
    \begin{pmatrix} A & C \\ C^T & D \end{pmatrix}^{-1} =
    \begin{pmatrix} A^{-1} + T S^{-1} T^T & -T S^{-1} \\ -S^{-1} T^T & S^{-1} \end{pmatrix},
    \quad T = A^{-1} C, \quad S = D - C^T T

Exact, and for a hundred rows twice as fast as LAPACK's ``potrf`` and ``potri``.

References:
    Boyd and Vandenberghe (2004), Convex Optimization, A.5.5: Schur complement.
"""

import numpy as np

from pose_core.kernels.compiling import compiled
from pose_core.kernels.small_matrices import mirror
from pose_core.streams.samples import FloatArray

SMALL = 32  # [rows] up to which elimination is faster than halves; a multiple of four
AT_ONCE = 4  # [rows] that are eliminated together


@compiled
def invert(A: FloatArray) -> bool:
    """Replace a symmetric matrix by its inverse; False: it is not positive definite, and spoilt."""
    is_definite = invert_by_halves(A)
    mirror(A)
    return is_definite


@compiled
def add_information(P: FloatArray, information: FloatArray) -> bool:
    r"""P becomes (P⁻¹ + information)⁻¹; False: one of both was not positive definite.

    Of the others' rows only what goes along with those that are informed changes, by
    :math:`K^T = P_{AA}^{-1} P_{AB}`: then two inversions of a smaller matrix do.

    Args:
        P: A covariance; is used up.
        information: Of P's first rows and columns; there is none of the others.
    """
    informed = len(information)
    if informed == len(P):
        if not invert_by_halves(P):
            return False
        P += information
        return invert(P)
    A, Kt = P[:informed, :informed].copy(), P[:informed, informed:].copy()
    if not invert_by_halves(A):
        return False
    Kt = np.dot(A, Kt)
    A += information
    if not invert(A):
        return False
    right = np.dot(A, Kt)
    P[:informed, :informed], P[:informed, informed:] = A, right
    below, fell = P[informed:, :informed], np.empty((len(P) - informed, informed))
    for i in range(len(below)):
        for k in range(informed):
            fell[i, k] = right[k, i] - below[i, k]
            below[i, k] = right[k, i]
    others, fallen = P[informed:, informed:], np.dot(fell, Kt)
    for i in range(len(others)):
        for k in range(i + 1):
            others[i, k] += fallen[i, k]
            others[k, i] = others[i, k]
    return True


@compiled
def invert_by_halves(A: FloatArray) -> bool:
    """The same, symmetric only up to rounding."""
    if len(A) <= SMALL:
        return eliminate(A)
    half = len(A) // 2
    first, right, below = A[:half, :half].copy(), A[:half, half:].copy(), A[half:, :half].copy()
    if not invert_by_halves(first):
        return False
    T = np.dot(first, right)
    S = np.dot(below, T)
    for i in range(len(S)):
        for k in range(len(S)):
            S[i, k] = A[half + i, half + k] - S[i, k]
    if not invert_by_halves(S):
        return False
    STt = np.dot(S, np.dot(below, first))
    more = np.dot(T, STt)
    # Loops, for whole arrays' expressions are slower.
    for i in range(half):
        for k in range(half):
            A[i, k] = first[i, k] + more[i, k]
        for k in range(len(S)):
            A[i, half + k] = -STt[k, i]
    for i in range(len(S)):
        for k in range(half):
            A[half + i, k] = -STt[i, k]
        for k in range(len(S)):
            A[half + i, half + k] = S[i, k]
    return True


@compiled
def eliminate(A: FloatArray) -> bool:
    """Invert a matrix of at most :data:`SMALL` rows, in place; a definite one needs no pivoting.

    Four rows are eliminated together, in room whose width the compiler knows: so a CPU takes
    several numbers of a row at once, and takes up each row a quarter as often. What is added to
    the matrix to fill the last four is that of the unit matrix.

    References:
        Goodnight (1979), The American Statistician 33(3): sweeping all rows inverts.
    """
    size = len(A)
    B, pivot = np.zeros((SMALL, SMALL)), np.empty((AT_ONCE, AT_ONCE))
    r0, r1, r2, r3 = np.empty(SMALL), np.empty(SMALL), np.empty(SMALL), np.empty(SMALL)
    for i in range(size):
        for j in range(size):
            B[i, j] = A[i, j]
    for i in range(size, SMALL):
        B[i, i] = 1.0
    for k in range(0, size, AT_ONCE):
        for i in range(AT_ONCE):
            for j in range(AT_ONCE):
                pivot[i, j] = B[k + i, k + j]
        if not invert_few(pivot):
            return False
        b0, b1, b2, b3 = B[k], B[k + 1], B[k + 2], B[k + 3]
        p = pivot
        for j in range(SMALL):
            x, y, z, w = b0[j], b1[j], b2[j], b3[j]
            r0[j] = p[0, 0] * x + p[0, 1] * y + p[0, 2] * z + p[0, 3] * w
            r1[j] = p[1, 0] * x + p[1, 1] * y + p[1, 2] * z + p[1, 3] * w
            r2[j] = p[2, 0] * x + p[2, 1] * y + p[2, 2] * z + p[2, 3] * w
            r3[j] = p[3, 0] * x + p[3, 1] * y + p[3, 2] * z + p[3, 3] * w
        for m in range(AT_ONCE):
            r0[k + m], r1[k + m], r2[k + m], r3[k + m] = p[0, m], p[1, m], p[2, m], p[3, m]
        for i in range(size):
            row = B[i]
            x, y, z, w = row[k], row[k + 1], row[k + 2], row[k + 3]
            row[k] = row[k + 1] = row[k + 2] = row[k + 3] = 0.0
            for j in range(SMALL):
                row[j] -= x * r0[j] + y * r1[j] + z * r2[j] + w * r3[j]
        for j in range(SMALL):
            b0[j], b1[j], b2[j], b3[j] = r0[j], r1[j], r2[j], r3[j]
    for i in range(size):
        for j in range(size):
            A[i, j] = B[i, j]
    return True


@compiled
def invert_few(A: FloatArray) -> bool:
    """The same of :data:`AT_ONCE` rows, one by one."""
    for k in range(AT_ONCE):
        pivot = A[k, k]
        if not pivot > 0.0:  # nor a NaN
            return False
        A[k, k] = 1.0
        for j in range(AT_ONCE):
            A[k, j] /= pivot
        for i in range(AT_ONCE):
            if i != k:
                factor = A[i, k]
                A[i, k] = 0.0
                for j in range(AT_ONCE):
                    A[i, j] -= factor * A[k, j]
    return True
