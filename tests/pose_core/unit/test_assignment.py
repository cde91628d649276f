"""The cheapest assignment is the one that scipy finds."""

import numpy as np
import pytest
from scipy.optimize import linear_sum_assignment

from pose_core.people.assignment import FORBIDDEN, assign


@pytest.mark.parametrize("shape", [(1, 1), (1, 7), (7, 1), (2, 2), (12, 24), (24, 12), (9, 9)])
@pytest.mark.parametrize("forbidden", [0.0, 0.4, 0.9])
def test_the_assignment_has_the_cost_of_scipys(shape, forbidden):
    rng = np.random.default_rng(4)
    for _ in range(30):
        cost = rng.uniform(-6.0, 6.0, shape)
        cost[rng.random(shape) < forbidden] = np.inf
        bounded = np.where(np.isfinite(cost), cost, FORBIDDEN)
        expected = [pair for pair in zip(*linear_sum_assignment(bounded), strict=True)
                    if np.isfinite(cost[pair])]  # fmt: skip
        pairs = assign(cost)
        assert len(pairs) == len(expected)
        assert sum(cost[pair] for pair in pairs) == pytest.approx(sum(cost[p] for p in expected))
        assert len({row for row, _ in pairs}) == len({column for _, column in pairs}) == len(pairs)


def test_ties_are_assigned():
    assert len(assign(np.zeros((5, 3)))) == 3


@pytest.mark.parametrize("shape", [(0, 3), (3, 0), (2, 2)])
def test_an_empty_cost_matrix_gives_no_assignment(shape):
    assert assign(np.full(shape, np.inf)) == []
