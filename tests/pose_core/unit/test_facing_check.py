import numpy as np
import pytest

from pose_core.filter.facing_check import BACKWARDS_S, FacingCheck, knees_forwards
from pose_core.filter.frame import CameraFrame
from pose_core.joints import JOINT_INDEX, JOINTS, TrackingState

FORWARDS, BACKWARDS = np.eye(3), np.diag([-1.0, -1.0, 1.0])
FRAME_S = 1.0 / 30.0


def standing(bend_m=0.0, seen=JOINTS):
    """Somebody who faces +x, with both knees this far in front of hips and feet."""
    joints = np.zeros((len(JOINTS), 3))
    for side, y in (("left", 0.1), ("right", -0.1)):
        for name, x, z in (("hip", 0.0, 0.9), ("knee", bend_m, 0.5), ("foot", 0.0, 0.1)):
            joints[JOINT_INDEX[f"{side}_{name}"]] = x, y, z
    states = [TrackingState.TRACKED if name in seen else TrackingState.INFERRED for name in JOINTS]
    return joints, np.array(states, np.uint8)


@pytest.mark.parametrize(("R", "expected"), [(FORWARDS, 2), (BACKWARDS, -2)])
def test_bent_knees_point_forwards(R, expected):
    assert knees_forwards(*standing(0.2), R) == expected


def test_straight_hidden_and_unmeasured_legs_tell_nothing():
    assert knees_forwards(*standing(0.03), FORWARDS) == 0
    without = [name for name in JOINTS if name != "left_foot"]
    assert knees_forwards(*standing(0.2, without), FORWARDS) == 1
    joints, states = standing(0.2)
    joints[JOINT_INDEX["right_knee"]] = np.nan
    assert knees_forwards(joints, states, FORWARDS) == 1


def frames_until_noticed(R, exchanged=False, most=60):
    check, (joints, states) = FacingCheck(), standing(0.2)
    joints[JOINT_INDEX["neck"], 2] = 1.5
    if exchanged:
        joints[:, 1] *= -1.0
    frame = CameraFrame(0, joints, states, np.zeros(3))
    for count in range(1, most):
        if check.faces_backwards(frame, R, FRAME_S):
            return count
    return None


def test_a_state_that_faces_backwards_is_noticed():
    frames = frames_until_noticed(BACKWARDS)
    assert frames * FRAME_S == pytest.approx(BACKWARDS_S, abs=0.05)
    assert frames_until_noticed(FORWARDS) is None
    # The tracker exchanges the sides: a state from this frame would face backwards, too.
    assert frames_until_noticed(BACKWARDS, exchanged=True) is None
