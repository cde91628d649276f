"""Clocks that are far off, by the stamps of samples that were recorded together."""

from types import SimpleNamespace

import numpy as np
import pytest

from pose_calibration.clocks.recorded_stamps import with_recorded_stamps
from pose_core.errors import InputError
from pose_core.streams.clocks import IMUS, ONE_IMU, Clock
from pose_core.streams.samples import ImuBlock

S = 1_000_000_000
BEGIN_NS = 1_700_000_000 * S
SEGMENTS = ("left_thigh", "right_thigh", "torso")


def block(stamp_ns, ahead_s):
    """One sample of each IMU, its clock ahead by so much [s]."""
    count = len(SEGMENTS)
    return ImuBlock(
        segments=SEGMENTS,
        imu=np.arange(count),
        stamps_ns=np.array([stamp_ns + round(each * S) for each in ahead_s]),
        orientation=np.tile([0.0, 0.0, 0.0, 1.0], (count, 1)),
        orientation_stddev=np.zeros((count, 3)),
        angular_velocity=np.zeros((count, 3)),
        linear_acceleration=np.zeros((count, 3)),
    )


def recording(imus_ahead_s=(0.0, 0.0, 0.0), right_ahead_s=0.0):
    for k in range(100):
        stamp_ns = BEGIN_NS + k * S // 30
        yield [SimpleNamespace(sensor="left", stamp_ns=stamp_ns)]
        yield [SimpleNamespace(sensor="right", stamp_ns=stamp_ns + round(right_ahead_s * S))]
        yield block(stamp_ns + S // 100, imus_ahead_s)


def test_stamps_in_time_need_no_clock():
    assert with_recorded_stamps(recording((0.2, -0.3, 0.0)), "left", {}) == {}


@pytest.mark.parametrize("ahead_s", [-3.0, 2.0, -1.7e9])
def test_a_single_imu_far_off_has_a_clock_of_its_own(ahead_s):
    clocks = with_recorded_stamps(recording((0.0, ahead_s, 0.0)), "left", {})
    assert list(clocks) == [f"{ONE_IMU}right_thigh"]
    assert clocks[f"{ONE_IMU}right_thigh"].offset_ns == pytest.approx(ahead_s * S, abs=1000)


def test_imus_that_are_all_far_off_share_a_clock():
    clocks = with_recorded_stamps(recording((-5.0, -5.0, -9.0)), "left", {})
    assert set(clocks) == {IMUS, f"{ONE_IMU}torso"}
    assert clocks[IMUS].offset_ns == pytest.approx(-5.0 * S, abs=S // 50)
    assert clocks[f"{ONE_IMU}torso"].offset_ns == pytest.approx(-4.0 * S, abs=1000)


def test_known_clocks_are_applied_first():
    known = {IMUS: Clock(offset_ns=-5 * S), "right": Clock(offset_ns=3 * S)}
    assert with_recorded_stamps(recording((-5.0, -5.0, -5.0), 3.0), "left", known) == known


def test_a_camera_far_off_is_an_error():
    with pytest.raises(
        InputError, match=r"the stamps of 'right' are \+3\.0 s from those of 'left'"
    ):
        with_recorded_stamps(recording(right_ahead_s=3.0), "left", {})
