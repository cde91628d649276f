"""Left/right swaps of trackers, undone by the prediction."""

import numpy as np
import pytest

from pose_core.body.average_body import neutral_pose
from pose_core.joints import JOINT_PAIRS, LIMB_JOINTS
from pose_core.kernels.left_right_swaps import SWAPS, undo_swaps

PREDICTED = neutral_pose()
LEGS, ARMS = ([JOINT_PAIRS[name] for name in limb] for limb in LIMB_JOINTS)


def exchanged(joints, pairs):
    """The joints with left and right of these pairs exchanged."""
    order = np.arange(len(joints))
    for left, right in pairs:
        order[left], order[right] = right, left
    return joints[order]


def with_raised_arms():
    """The joints of somebody who has raised both arms since the last frame."""
    joints = PREDICTED.copy()
    for joint in ("elbow", "hand"):
        joints[JOINT_PAIRS[joint]] += [0.6, 0.0, 0.5]
    return joints


def undone(observed):
    """The number of swaps, and the joints without them."""
    order = np.arange(len(observed))
    return undo_swaps(observed, PREDICTED, SWAPS, order), observed[order]


@pytest.mark.parametrize(
    ("pairs", "count"),
    [
        pytest.param([], 0, id="none"),
        pytest.param(LEGS, 1, id="legs"),
        pytest.param(ARMS, 1, id="arms"),
        pytest.param([*LEGS, *ARMS], 2, id="both"),
    ],
)
def test_legs_and_arms_are_exchanged_as_far_as_they_fit(pairs, count):
    swaps, joints = undone(exchanged(PREDICTED, pairs))

    assert swaps == count
    np.testing.assert_array_equal(joints, PREDICTED)


def test_arms_that_moved_are_exchanged_with_the_legs_where_the_shoulders_are_too():
    person = with_raised_arms()

    swaps, joints = undone(exchanged(person, [*LEGS, *ARMS]))

    assert swaps == 2
    np.testing.assert_array_equal(joints, person)


def test_arms_that_moved_stay_where_the_shoulders_are_right():
    person = with_raised_arms()

    swaps, joints = undone(exchanged(person, LEGS))

    assert swaps == 1
    np.testing.assert_array_equal(joints, person)


def test_where_the_shoulders_are_not_seen_the_legs_are_exchanged_alone():
    person = with_raised_arms()
    person[JOINT_PAIRS["shoulder"]] = np.nan

    assert undone(exchanged(person, [*LEGS, *ARMS]))[0] == 1
