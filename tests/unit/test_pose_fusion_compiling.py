"""Kernels whose callers' types stay the same."""

from typing import NamedTuple

import numpy as np
import pytest

from pose_core.body.model import load_body_model
from pose_core.body.segment_tree import SegmentTree
from pose_core.filters.segment_filter import NO_CAMERAS, SegmentFilter
from pose_core.fusion.preparing import neutral_pose
from pose_core.kernels.compiling import compiled, settled
from pose_core.session.neutral_stand import shape_of


class Pair(NamedTuple):
    first: np.ndarray
    second: float


@compiled
def weighted_sum(pair, out):
    out[0] = pair.first.sum() * pair.second
    return out[0]


def test_a_settled_kernel_gives_what_the_kernel_gives():
    call = settled(weighted_sum)
    for factor in (2.0, -1.5):
        pair, out = Pair(np.arange(5.0), factor), np.zeros(1)
        assert call(pair, out) == weighted_sum(pair, out) == 10.0 * factor
        assert out[0] == 10.0 * factor


def test_each_caller_settles_for_itself():
    rows = np.arange(12.0).reshape(3, 4)
    for array in (rows[0], rows[:, 1]):
        assert settled(weighted_sum)(Pair(array, 1.0), np.zeros(1)) == array.sum()


def test_while_tests_run_other_types_than_before_are_an_error():
    """See ``checked_kernels``: without it they would be taken for what they are not."""
    call = settled(weighted_sum)
    call(Pair(np.arange(5.0), 1.0), np.zeros(1))
    with pytest.raises(TypeError, match="settled"):
        call(Pair(np.arange(10.0)[::2], 1.0), np.zeros(1))


def test_rows_that_lie_apart_are_refused_by_the_filter():
    model = load_body_model("default")
    filter_ = SegmentFilter(SegmentTree(model, shape_of(model, neutral_pose())))
    filter_.start(np.tile(np.eye(3), (filter_.layout.links, 1, 1)), np.zeros(3))
    apart = np.zeros((1, 15, 6))[:, :, ::2]
    with pytest.raises(ValueError, match="contiguous"):
        filter_.update(NO_CAMERAS._replace(positions=apart))
