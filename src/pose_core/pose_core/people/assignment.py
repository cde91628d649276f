"""The cheapest assignment of rows to columns."""

import numpy as np

from pose_core.streams.samples import FloatArray

FORBIDDEN = 1e3  # in place of an infinite cost


def assign(cost: FloatArray) -> list[tuple[int, int]]:
    """Pairs of indices with the least sum of costs; infinite ones are never paired.

    As many pairs as can be are made, and of these the cheapest.

    Args:
        cost: (rows, columns), infinite where a pair is out of the question.
    """
    if cost.size == 0 or not np.isfinite(cost).any():
        return []
    if cost.shape[1] == 1:
        return [(int(np.argmin(cost[:, 0])), 0)]
    # Loads scipy for half a second, which one person alone never needs.
    from scipy.optimize import linear_sum_assignment

    rows, columns = linear_sum_assignment(np.where(np.isfinite(cost), cost, FORBIDDEN))
    return [
        (int(row), int(column))
        for row, column in zip(rows, columns, strict=True)
        if np.isfinite(cost[row, column])
    ]
