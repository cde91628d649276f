"""Which offsets between IMUs and cameras are those of clocks, and which are trackers' delays."""

import pytest

from pose_calibration.inertial.imu_clock import TRACKER_DELAY_S, is_clocks
from pose_core.api import Clock

EXACT, TYPICAL = 0.002, 0.024  # [s] standard deviations


@pytest.mark.parametrize("delay_s", [0.0, 0.06, 0.15])
def test_what_a_tracker_may_be_late_is_no_offset_of_clocks(delay_s):
    assert not is_clocks(TRACKER_DELAY_S - delay_s, EXACT, {})


@pytest.mark.parametrize("delay_s", [-0.1, 0.3])
def test_trackers_that_are_early_or_too_late_have_another_clock(delay_s):
    assert is_clocks(TRACKER_DELAY_S - delay_s, EXACT, {})


def test_a_tracker_that_seems_early_within_the_errors_is_in_time():
    assert not is_clocks(TRACKER_DELAY_S + 0.04, TYPICAL, {})


def test_the_reference_is_late_by_what_another_camera_seems_early():
    behind = {"right": Clock(offset_ns=-48_000_000, stddev_s=0.003)}
    assert is_clocks(TRACKER_DELAY_S + 0.04, TYPICAL, behind)
