"""Joints that no camera tracks."""

import numpy as np

from pose_core.joints import JOINTS, TrackingState
from pose_core.streams.tracked_joints import MIN_SKELETONS, TrackedJoints

KNEE = JOINTS.index("left_knee")


def states(count: int, knee: TrackingState) -> np.ndarray:
    state = np.full((count, len(JOINTS)), TrackingState.TRACKED, np.uint8)
    state[:, KNEE] = knee
    return state


def test_a_joint_that_is_only_guessed_is_named():
    joints = TrackedJoints()
    joints.add(states(200, TrackingState.INFERRED))
    assert joints.missing == ("left_knee",)


def test_one_camera_that_tracks_it_suffices():
    joints = TrackedJoints()
    for knee in (TrackingState.NOT_TRACKED, TrackingState.TRACKED):
        joints.add(states(200, knee))
    assert joints.missing == ()


def test_the_first_skeletons_are_not_judged():
    joints = TrackedJoints()
    for state in states(MIN_SKELETONS - 1, TrackingState.NOT_TRACKED):
        joints.add(state)
    assert joints.missing == ()
