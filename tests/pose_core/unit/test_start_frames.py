"""The filter starts from a frame whose sides the other cameras confirm."""

import numpy as np
import pytest

from pose_core.estimates.observation import Observation
from pose_core.filter.start_frames import StartFrames
from pose_core.imu.imu_history import NO_MEASUREMENTS
from pose_core.joints import JOINT_INDEX, JOINTS, SIDES

BEGIN_NS = 10**18
MS = 1_000_000
FRONT, BACK = [2.0, 0.0, 1.0], [-2.0, 0.0, 1.0]  # of a person who faces x


def person(*, exchanged=()):
    """A standing person with these joints exchanged by the tracker."""
    joints = np.zeros((len(JOINTS), 3))
    for name, z in (("neck", 1.5), ("head", 1.7), ("torso", 1.2)):
        joints[JOINT_INDEX[name]] = [0.0, 0.0, z]
    for side, y in zip(SIDES, (0.2, -0.2), strict=True):
        for name, z in (("shoulder", 1.4), ("hip", 0.9), ("knee", 0.5), ("foot", 0.1)):
            sign = -1.0 if name in exchanged else 1.0
            joints[JOINT_INDEX[f"{side}_{name}"]] = [0.0, sign * y, z]
    return joints


SWAPPED = person(exchanged=("shoulder", "hip", "knee", "foot"))
LEGS_SWAPPED = person(exchanged=("hip", "knee", "foot"))


def observed(sensor, joints, *, at_ms=0, cameras=(FRONT, BACK)):
    positions = np.full((len(cameras), len(JOINTS), 3), np.nan)
    positions[sensor] = joints
    return Observation(
        stamp_ns=BEGIN_NS + at_ms * MS,
        newest_ns=BEGIN_NS,
        shape=None,
        positions=positions,
        tracking_state=np.where(np.isfinite(positions[..., 0]), 2, 0).astype(np.uint8),
        cameras=np.array(cameras),
        imus=NO_MEASUREMENTS,
    )


def chosen(*frames, cameras=(FRONT, BACK)):
    start = StartFrames(len(cameras))
    for sensor, joints in frames:
        start.add(observed(sensor, joints, at_ms=10 * sensor, cameras=cameras))
    return start.choose(BEGIN_NS + 10 * len(cameras) * MS)


@pytest.mark.parametrize("wrong", [SWAPPED, LEGS_SWAPPED], ids=["whole", "legs"])
@pytest.mark.parametrize("which", [0, 1, 2])
def test_two_of_three_cameras_are_believed(wrong, which):
    frames = [(k, wrong if k == which else person()) for k in range(3)]
    joints, waits = chosen(*frames, cameras=(FRONT, BACK, BACK))
    assert not waits
    np.testing.assert_array_equal(joints, person())


@pytest.mark.parametrize("first", [0, 1])
def test_of_two_contradicting_views_the_one_that_shows_the_back_is_believed(first):
    """Both cameras are behind the person; one of them takes the back for the front."""
    frames = [(first, person()), (1 - first, SWAPPED)]
    joints, _ = chosen(*sorted(frames, key=lambda each: each[0]), cameras=(BACK, BACK))
    np.testing.assert_array_equal(joints, person())


def test_exchanged_legs_alone_contradict_the_arms():
    joints, _ = chosen((0, person()), (1, LEGS_SWAPPED))
    np.testing.assert_array_equal(joints, person())


@pytest.mark.parametrize(("period_ms", "waiting"), [(33, 4), (100, 1), (500, 1)])
def test_the_start_waits_for_the_other_cameras_but_not_for_long(period_ms, waiting):
    """The other camera is silent."""
    start, waits = StartFrames(2), []
    for at_ms in range(0, 6 * period_ms, period_ms):
        start.add(observed(0, person(), at_ms=at_ms))
        joints, has_to_wait = start.choose(BEGIN_NS + at_ms * MS)
        waits.append(has_to_wait)
    assert waits == [True] * waiting + [False] * (6 - waiting)
    np.testing.assert_array_equal(joints, person())


def test_a_single_camera_is_not_waited_for():
    joints, waits = chosen((0, person()), cameras=(FRONT,))
    assert not waits
    np.testing.assert_array_equal(joints, person())


def test_frames_without_the_trunk_and_old_ones_do_not_count():
    start = StartFrames(1)
    without = person()
    without[JOINT_INDEX["left_hip"]] = np.nan
    start.add(observed(0, without, cameras=(FRONT,)))
    assert start.choose(BEGIN_NS) == (None, False)
    start.add(observed(0, person(), cameras=(FRONT,)))
    assert start.choose(BEGIN_NS + 500 * MS) == (None, False)
