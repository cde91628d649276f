r"""The cheapest assignment of rows to columns, by shortest augmenting paths.

Rows are assigned one after the other. With prices u of the rows and v of the columns, for which

.. math:: c_{ij} - u_i - v_j \ge 0, \quad = 0 \text{ where } i \text{ has } j

each takes the column at the end of the shortest path over columns whose rows must change theirs.
In plain numpy: scipy, which has the same, takes 0.3 s to load when a second person comes into view.

References:
    Jonker, Volgenant (1987), A shortest augmenting path algorithm for dense and sparse linear
    assignment problems, Computing 38.
"""

import numpy as np

from pose_core.arrays import FloatArray

FORBIDDEN = 1e3  # in place of an infinite cost


def assign(cost: FloatArray) -> list[tuple[int, int]]:
    """Pairs of indices with the least sum of costs, sorted; infinite ones are never paired.

    As many pairs as can be are made, and of these the cheapest.

    Args:
        cost: (rows, columns), infinite where a pair is out of the question.
    """
    if cost.size == 0 or not np.isfinite(cost).any():
        return []
    if cost.shape[1] == 1:
        return [(int(cost.argmin()), 0)]
    bounded = np.where(np.isfinite(cost), cost, FORBIDDEN)
    if len(cost) <= cost.shape[1]:
        pairs = [(row, column) for column, row in enumerate(_rows_of(bounded)) if row >= 0]
    else:
        pairs = [(row, column) for row, column in enumerate(_rows_of(bounded.T)) if column >= 0]
    return sorted((row, column) for row, column in pairs if np.isfinite(cost[row, column]))


def _rows_of(cost: FloatArray) -> list[int]:
    """The row that each column gets, -1: none; costs are finite, (rows, at least as many)."""
    rows, columns = cost.shape
    u, v = np.zeros(rows), np.zeros(columns)
    row_of = np.full(columns, -1)
    for first in range(rows):
        length, before = np.full(columns, np.inf), np.full(columns, -1)
        is_open = np.ones(columns, np.bool_)
        row, column, way = first, -1, 0.0
        while True:
            reduced = way + cost[row] - u[row] - v
            is_shorter = is_open & (reduced < length)
            length[is_shorter], before[is_shorter] = reduced[is_shorter], column
            column = int(np.argmin(np.where(is_open, length, np.inf)))
            row, way = int(row_of[column]), float(length[column])
            if row < 0:
                break
            is_open[column] = False
        passed = ~is_open
        u[first] += way
        u[row_of[passed]] += way - length[passed]
        v[passed] -= way - length[passed]
        while column >= 0:
            above = int(before[column])
            row_of[column] = row_of[above] if above >= 0 else first
            column = above
    found: list[int] = row_of.tolist()
    return found
