"""Kernels whose callers' types stay the same."""

from itertools import combinations
from typing import NamedTuple

import numba
import numpy as np
import pytest
from checked_kernels import layout

from pose_core.kernels.compiling import compiled, type_specialised


class Pair(NamedTuple):
    first: np.ndarray
    second: float


class Other(NamedTuple):
    first: np.ndarray
    second: float


@compiled
def weighted_sum(pair, out):
    out[0] = pair.first.sum() * pair.second
    return out[0]


def test_a_type_specialised_kernel_gives_the_kernels_result():
    call = type_specialised(weighted_sum)
    for factor in (2.0, -1.5):
        pair, out = Pair(np.arange(5.0), factor), np.zeros(1)
        assert call(pair, out) == weighted_sum(pair, out) == 10.0 * factor
        assert out[0] == 10.0 * factor


def test_each_caller_is_specialised_separately():
    rows = np.arange(12.0).reshape(3, 4)
    for array in (rows[0], rows[:, 1]):
        assert type_specialised(weighted_sum)(Pair(array, 1.0), np.zeros(1)) == array.sum()


def test_other_argument_types_are_an_error_in_tests():
    """See ``checked_kernels``: without it they would be taken for what they are not."""
    call = type_specialised(weighted_sum)
    call(Pair(np.arange(5.0), 1.0), np.zeros(1))
    with pytest.raises(TypeError, match="settled"):
        call(Pair(np.arange(10.0)[::2], 1.0), np.zeros(1))


def test_arguments_of_different_types_are_told_apart_by_their_layout():
    square = np.arange(16.0).reshape(4, 4)
    read_only = square.copy()
    read_only.flags.writeable = False
    arrays = [square, square.T, square[::2], square[0], square[:, 0], read_only]
    arrays += [square.astype(kind) for kind in (np.float32, np.int64, np.uint8, bool)]
    arguments = [*arrays, 1.0, 1, 2**63, True, np.float64(1.0), np.int32(1), None, (), (1.0, 1)]
    arguments += [kind(array, 1.0) for kind in (Pair, Other) for array in arrays]
    arguments += [Pair(square, 1), Pair((square, square), 1.0), (square, 1.0)]
    for one, other in combinations(arguments, 2):
        if numba.typeof(one) != numba.typeof(other):
            assert layout(one) != layout(other)
