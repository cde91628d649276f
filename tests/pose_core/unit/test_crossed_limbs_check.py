import numpy as np
import pytest

from pose_core.filter.crossed_limbs_check import CROSSED_ALONE_S, CROSSED_S, CrossedLimbsCheck
from pose_core.filter.frame import CameraFrame
from pose_core.joints import JOINT_INDEX, JOINTS, SIDES

FRAME_S = 1.0 / 60.0  # of two cameras with 30 frames a second


def frame_of(sensor, legs_exchanged=False):
    """Somebody who faces +x."""
    positions = np.zeros((len(JOINTS), 3))
    for side, y in zip(SIDES, (0.15, -0.15), strict=True):
        positions[JOINT_INDEX[f"{side}_shoulder"], 1] = y
        positions[JOINT_INDEX[f"{side}_hip"], 1] = -y if legs_exchanged else y
    return CameraFrame(sensor, positions, np.full(len(JOINTS), 2, np.uint8), np.zeros(3))


def frames_until_noticed(sensors, swaps, most=100, **options):
    check = CrossedLimbsCheck()
    for frame in range(most):
        measured = frame_of(sensors[frame % len(sensors)], **options)
        if check.is_crossed(measured, swaps[frame % len(swaps)], FRAME_S):
            return frame
    return None


def test_the_same_limbs_of_all_frames_of_two_cameras():
    assert frames_until_noticed((0, 1), (1,)) == pytest.approx(CROSSED_S / FRAME_S, abs=1)


def test_a_camera_that_is_alone_is_believed_later_because_its_tracker_may_be_wrong():
    found = frames_until_noticed((0,), (1,), most=200)
    assert found == pytest.approx(CROSSED_ALONE_S / FRAME_S, abs=1)


@pytest.mark.parametrize(
    ("sensors", "swaps"),
    [
        ((0, 1), (1, 0)),  # the other camera agrees with the state
        ((0, 1), (2,)),  # both see the person's back
    ],
)
def test_others_tell_nothing(sensors, swaps):
    assert frames_until_noticed(sensors, swaps) is None


def test_frames_whose_own_hips_and_shoulders_disagree_tell_nothing():
    assert frames_until_noticed((0, 1), (1,), legs_exchanged=True) is None
