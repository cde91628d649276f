"""The offset between two clocks, from motion."""

import numpy as np
import pytest
from walking_person import samples

from pose_calibration.clocks.clock_offset import estimate_clock_offset


def streams(**options):
    some = samples(**{"duration_s": 15.0, **options})
    return [[one for one in some if one.sensor == name] for name in ("left", "right")]


@pytest.mark.parametrize("ahead_s", [-0.31, -0.05, 0.04, 0.12])
def test_the_offset_is_found_to_a_few_milliseconds(ahead_s):
    left, right = streams(offset_s={"right": ahead_s})
    offset = estimate_clock_offset(left, right)
    assert offset.observable
    assert offset.estimate_s == pytest.approx(ahead_s, abs=0.004)
    assert offset.clock.offset_ns == pytest.approx(ahead_s * 1e9, abs=4e6)


def test_exchanging_the_sensors_turns_the_sign():
    left, right = streams(offset_s={"right": 0.1})
    assert estimate_clock_offset(right, left).estimate_s == pytest.approx(-0.1, abs=0.004)


def test_clocks_that_agree_are_found_to_agree():
    left, right = streams()
    offset = estimate_clock_offset(left, right)
    assert offset.observable
    assert abs(offset.clock.offset_ns) < 5_000_000


def test_a_standing_person_determines_no_offset():
    left, right = streams(offset_s={"right": 0.1}, walks=False, moves=False)
    offset = estimate_clock_offset(left, right)
    assert not offset.observable
    assert offset.clock is None


def test_an_offset_beyond_the_reach_is_not_invented():
    left, right = streams(offset_s={"right": 0.9})
    assert not estimate_clock_offset(left, right, max_offset_s=0.2).observable


def test_too_few_frames_determine_no_offset():
    left, right = streams(duration_s=0.5)
    assert estimate_clock_offset(left, right).stddev_s == np.inf


def test_views_without_overlap_determine_no_offset():
    left, right = streams(duration_s=4.0)
    _, late = streams(duration_s=4.0, offset_s={"right": 30.0})
    assert not estimate_clock_offset(left, late).observable
    assert len(right) == len(late)
