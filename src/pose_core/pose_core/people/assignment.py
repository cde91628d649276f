"""The cheapest assignment of rows to columns, in which some pairs are forbidden."""

import numpy as np
from scipy.optimize import linear_sum_assignment

from pose_core.arrays import FloatArray

FORBIDDEN = 1e3  # in place of an infinite cost, with which no assignment may exist


def assign(cost: FloatArray) -> list[tuple[int, int]]:
    """Pairs of indices with the least sum of costs, sorted; infinite ones are never paired.

    As many pairs as can be are made, and of these the cheapest.

    Args:
        cost: (rows, columns), infinite where a pair is out of the question.
    """
    rows, columns = linear_sum_assignment(np.where(np.isfinite(cost), cost, FORBIDDEN))
    is_allowed = np.isfinite(cost[rows, columns])
    return list(zip(rows[is_allowed].tolist(), columns[is_allowed].tolist(), strict=True))
