"""The cheapest assignment, compared with all assignments."""

from itertools import permutations

import numpy as np
import pytest

from pose_core.people.association import assign


@pytest.mark.parametrize("shape", [(1, 1), (1, 5), (5, 1), (2, 2), (3, 5), (5, 3), (4, 4)])
@pytest.mark.parametrize("forbidden", [0.0, 0.4, 0.9])
def test_no_other_assignment_has_more_pairs_or_costs_less(shape, forbidden):
    rng = np.random.default_rng(4)
    for _ in range(10):
        cost = rng.uniform(-6.0, 6.0, shape)
        cost[rng.random(shape) < forbidden] = np.inf
        pairs = assign(cost)
        assert pairs == sorted(pairs)
        assert len({row for row, _ in pairs}) == len({column for _, column in pairs}) == len(pairs)
        best = min(map(quality, all_assignments(cost)))
        assert quality([cost[pair] for pair in pairs]) == pytest.approx(best)


def all_assignments(cost):
    """The allowed costs of every way to give each row of the shorter side another column."""
    wide = cost if cost.shape[0] <= cost.shape[1] else cost.T
    for columns in permutations(range(wide.shape[1]), len(wide)):
        chosen = wide[np.arange(len(wide)), columns]
        yield chosen[np.isfinite(chosen)]


def quality(costs):
    return -len(costs), sum(costs)


def test_ties_are_assigned():
    assert len(assign(np.zeros((5, 3)))) == 3


@pytest.mark.parametrize("shape", [(0, 3), (3, 0), (2, 2)])
def test_an_empty_cost_matrix_gives_no_assignment(shape):
    assert assign(np.full(shape, np.inf)) == []
