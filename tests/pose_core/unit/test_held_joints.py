"""Joints that a tracker repeats while others move are no measurements."""

import numpy as np
import pytest

from pose_core.joints import JOINT_INDEX, JOINTS, TrackingState
from pose_core.streams.held_joints import HELD_FRAMES, LOST_FRAMES, HeldJoints
from pose_core.streams.samples import SkeletonSample

HAND = JOINT_INDEX["left_hand"]


def frames(count, held_from=None, joints=(HAND,)):
    """Frames of a moving person; some joints are held from a frame on."""
    rng = np.random.default_rng(1)
    positions = rng.normal(size=(count, len(JOINTS), 3))
    if held_from is not None:
        positions[held_from:, joints] = positions[held_from, joints]
    return [
        SkeletonSample(
            stamp_ns=index,
            sensor="left",
            person="1",
            positions=each,
            tracking_state=np.full(len(JOINTS), int(TrackingState.TRACKED), np.uint8),
        )
        for index, each in enumerate(positions)
    ]


def test_a_held_joint_becomes_inferred_then_not_tracked_and_is_named():
    check = HeldJoints()
    states = np.array([check.checked(each).tracking_state for each in frames(30, held_from=10)])
    assert (states[: 10 + HELD_FRAMES] == TrackingState.TRACKED).all()
    held = states[10 + HELD_FRAMES :, HAND]
    assert (held[: LOST_FRAMES - HELD_FRAMES] == TrackingState.INFERRED).all()
    assert (held[LOST_FRAMES - HELD_FRAMES :] == TrackingState.NOT_TRACKED).all()
    assert (np.delete(states, HAND, axis=1) == TrackingState.TRACKED).all()
    assert check.held == {"left": ["left_hand"]}

    moved = check.checked(frames(1)[0])
    assert moved.tracking_state[HAND] == TrackingState.TRACKED
    assert check.held == {"left": []}


@pytest.mark.parametrize("held_from", [0, None])
def test_joints_that_never_moved_and_moving_ones_are_tracked(held_from):
    check = HeldJoints()
    for each in frames(30, held_from):
        assert (check.checked(each).tracking_state == TrackingState.TRACKED).all()


def test_repeated_frames_are_another_matter():
    check = HeldJoints()
    for each in frames(30, held_from=10, joints=range(len(JOINTS))):
        assert (check.checked(each).tracking_state == TrackingState.TRACKED).all()
