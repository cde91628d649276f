r"""Robust measurement update: Student's t by iteratively reweighted least squares.

With a weight w for each group of rows, and an error common to all rows with the derivatives c,
:math:`S = H P H^T + c\,c^T + R / w`, :math:`\delta x = P H^T S^{-1} r`,
:math:`P \leftarrow P - P H^T S^{-1} H P`. The common error is estimated as
:math:`\epsilon = c^T S^{-1} r`, with the variance :math:`1 - c^T S^{-1} c`. Each group's weight
follows from its residual after the update,
:math:`e = r - H\,\delta x - c\,\epsilon = R / w\,S^{-1} r`:

.. math:: w = \frac{\nu + d}{\nu + e^T R^{-1} e}, \quad w_\mathrm{least} \le w \le 1

with d its number of rows and ν its degrees of freedom. The first weights follow in the same way
from the innovations and their covariance, r and S. All iterations take place
in measurement space. With the Cholesky factorisation :math:`S = U^T U`, the state needs two
substitutions; with :math:`W = U^{-T} H P` the covariance is :math:`P - W^T W`, of which one
half is computed.

References:
    Roth, Özkan, Gustafsson (2013), A Student's t filter for heavy tailed process and measurement
    noise, ICASSP.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pose_core.arrays import FloatArray
from pose_core.filter.heading_drift import heading_variances, update_drifts
from pose_core.filter.rows import NORMAL, Rows
from pose_core.filter.state import FilterState, inject_error
from pose_core.kernels.cholesky import factorise, solve_lower, solve_vector
from pose_core.kernels.compiling import compiled, compiled_in_place, compiled_into_caller
from pose_core.kernels.linear_algebra import inverse, quadratic_form, symmetric

BLOCK = 52  # rows of P that are computed together


class UpdateConstants(NamedTuple):
    """Parameters of a robust update."""

    iterations: int  # solutions, at least one; weights are recomputed between them
    least_weight: float  # [-] lower bound of a group's weight


class UpdateResult(NamedTuple):
    """Result of a robust update, in addition to the state."""

    is_finite: bool  # otherwise the state is unchanged
    weights: FloatArray  # (groups,) [-]
    nis: FloatArray  # (groups,) [-] normalised innovation squared
    HPHt: FloatArray  # (rows, rows), the upper triangle
    common_error: float  # [-] the estimated error that all rows have in common
    common_variance: float  # [-]


@compiled
def robust_update(constants: UpdateConstants, state: FilterState, rows: Rows) -> UpdateResult:
    """Update the state with some measurement rows, in place."""
    least_weight = constants.least_weight
    count, groups, P = rows.filled[0], rows.filled[1], state.P
    H, residual = rows.H[:count], rows.residual[:count]
    HP, HPHt = np.zeros((count, len(P))), np.zeros((count, count))
    used, used_count = np.empty((count, H.shape[1] + 1), np.int64), np.empty(count, np.int64)
    find_used(H, used, used_count)
    add_product(H, used, used_count, P, HP, False)
    add_product(H, used, used_count, np.ascontiguousarray(HP.T), HPHt, True)
    common = rows.common[:count]
    expected = HPHt.copy()
    add_square(common, expected)
    S, solved = expected.copy(), np.empty(count)
    weights, nis = np.ones(groups), np.empty(groups)
    add_noise(rows, weights, S)
    fill_nis(rows, S, nis)
    for group in range(groups):
        weights[group] = weight_of(rows, group, nis[group], least_weight)
    for iteration in range(constants.iterations):
        S[:] = expected
        add_noise(rows, weights, S)
        factorise(S)
        solved[:] = residual
        solve_vector(S, solved)
        if iteration < constants.iterations - 1:
            reweight(rows, solved, least_weight, weights)
    error = np.dot(solved, HP)
    is_finite = bool(np.all(np.isfinite(error)))
    explained = common.copy()
    solve_vector(S, explained)
    result = UpdateResult(
        is_finite, weights, nis, HPHt, np.dot(common, solved), 1.0 - np.dot(common, explained)
    )
    if not is_finite:
        return result
    before = heading_variances(state)
    solve_lower(S, HP)
    subtract_square(P, HP)
    update_drifts(state, before, error)
    inject_error(state, error)
    return result


@compiled_in_place
def find_used(H: FloatArray, used: NDArray[np.int64], count: NDArray[np.int64]) -> None:
    """Fill the columns of each row's elements that are not 0, (rows, columns + 1), and how many."""
    for row in range(len(H)):
        own, found = used[row], 0
        for column in range(H.shape[1]):
            own[found] = column
            found += H[row, column] != 0.0
        count[row] = found


@compiled_in_place
def add_product(
    H: FloatArray,
    used: NDArray[np.int64],
    count: NDArray[np.int64],
    A: FloatArray,
    out: FloatArray,
    is_symmetric: bool,
) -> None:
    """``out`` += H A by the elements that :func:`find_used` found, four of a row at a time.

    Of a symmetric product only the upper triangle is computed.
    """
    for row in range(len(H)):
        first, factors, own = row if is_symmetric else 0, H[row], used[row]
        into, whole = out[row, first:], count[row] - count[row] % 4
        for at in range(0, whole, 4):
            i, j, m, n = own[at], own[at + 1], own[at + 2], own[at + 3]
            a, b, c, d = factors[i], factors[j], factors[m], factors[n]
            w, x, y, z = A[i, first:], A[j, first:], A[m, first:], A[n, first:]
            for k in range(len(into)):
                into[k] += a * w[k] + b * x[k] + c * y[k] + d * z[k]
        for at in range(whole, count[row]):
            factor, values = factors[own[at]], A[own[at], first:]
            for k in range(len(into)):
                into[k] += factor * values[k]


@compiled_in_place
def add_square(c: FloatArray, S: FloatArray) -> None:
    """S += c cᵀ, the upper triangle."""
    for i in range(len(c)):
        if c[i] != 0.0:
            for k in range(i, len(c)):
                S[i, k] += c[i] * c[k]


@compiled_in_place
def add_noise(rows: Rows, weights: FloatArray, S: FloatArray) -> None:
    """S += R / w."""
    for group in range(rows.filled[1]):
        first, noise = rows.first[group], rows.noise[group]
        for i in range(rows.size[group]):
            for k in range(rows.size[group]):
                S[first + i, first + k] += noise[i, k] / weights[group]


@compiled_in_place
def fill_nis(rows: Rows, S: FloatArray, nis: FloatArray) -> None:
    """Compute rᵀ S⁻¹ r of each group with its own block of S."""
    for group in range(rows.filled[1]):
        first, size = rows.first[group], rows.size[group]
        r, block = rows.residual[first : first + size], S[first : first + size, first:]
        if size == 1:
            nis[group] = r[0] ** 2 / block[0, 0]
        else:
            nis[group] = quadratic_form(inverse(symmetric(block)), r)


@compiled_in_place
def reweight(rows: Rows, solved: FloatArray, least_weight: float, weights: FloatArray) -> None:
    """Compute the weights from the residuals after the update.

    With y = S⁻¹ r, they are e = r − H P Hᵀ y = R / w y, so that eᵀ R⁻¹ e = yᵀ R y / w².

    Args:
        rows: The measurement rows.
        solved: y, (rows,).
        least_weight: Lower bound of a group's weight [-].
        weights: The weights of S, (groups,); replaced.
    """
    for group in range(rows.filled[1]):
        first, size, noise = rows.first[group], rows.size[group], rows.noise[group]
        y = solved[first : first + size]
        squared = noise[0, 0] * y[0] ** 2 if size == 1 else quadratic_form(symmetric(noise), y)
        weights[group] = weight_of(rows, group, squared / weights[group] ** 2, least_weight)


@compiled_in_place
def weight_of(rows: Rows, group: int, squared: float, least_weight: float) -> float:
    """Weight of a group with a squared residual distance."""
    dof = rows.student_dof[group]
    if dof == NORMAL:
        return 1.0
    weight = (dof + rows.size[group]) / (dof + squared)
    return min(max(weight, least_weight), 1.0)


@compiled_into_caller
def subtract_square(P: FloatArray, W: FloatArray) -> None:
    """P −= Wᵀ W: the upper triangle in blocks; the lower one is mirrored."""
    for first in range(0, len(P), BLOCK):
        rest = np.ascontiguousarray(W[:, first:])
        block = np.ascontiguousarray(rest[:, :BLOCK])
        subtract_rows(P, first, np.dot(block.T, rest))
    mirror(P)


@compiled_in_place
def subtract_rows(P: FloatArray, first: int, block: FloatArray) -> None:
    """Subtract a block from P, with its upper left element on P's diagonal."""
    for i in range(len(block)):
        row, values = P[first + i, first:], block[i]
        for k in range(len(values)):
            row[k] -= values[k]


@compiled_in_place
def mirror(A: FloatArray) -> None:
    """Copy the upper triangle of a square matrix to the lower one."""
    for i in range(len(A)):
        for j in range(i):
            A[i, j] = A[j, i]
