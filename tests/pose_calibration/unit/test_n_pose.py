"""Detection of the N-pose and of the trackers' offsets in it."""

import numpy as np
import pytest
from moving_body import raise_limb, standing

from pose_calibration.imus.n_pose import NPoseDetector, is_n_pose, n_pose_joints
from pose_core.joints import JOINT_INDEX, TrackingState

PERIOD_NS = 33_333_333


def detect(views):
    """What is found in views, shape (n, sensors, 15, 3) [m], at 30 Hz."""
    detector = NPoseDetector()
    state = np.full(views.shape[1:3], TrackingState.TRACKED, np.uint8)
    found = [detector.add(10**9 + k * PERIOD_NS, each, state) for k, each in enumerate(views)]
    return next((each for each in found if each is not None), None)


def views(count=60):
    rng = np.random.default_rng(1)
    return standing(2 * count).reshape(count, 2, 15, 3) + rng.normal(0.0, 0.003, (count, 2, 15, 3))


def test_each_tracker_s_offset_of_a_joint_is_found():
    some = views()
    some[:, 1, JOINT_INDEX["left_knee"]] += 0.03, 0.0, 0.01
    offsets = detect(some).offsets
    np.testing.assert_allclose(offsets[1, JOINT_INDEX["left_knee"]], [0.03, 0.0, 0.01], atol=0.004)
    offsets[1, JOINT_INDEX["left_knee"]] = 0.0
    assert np.abs(offsets).max() < 0.004


def test_a_gross_error_is_no_offset():
    some = views()
    some[:, 1, JOINT_INDEX["left_hand"]] += 0.0, 0.3, 0.0
    assert np.all(detect(some).offsets[1, JOINT_INDEX["left_hand"]] == 0.0)


def test_a_walking_person_is_in_no_n_pose():
    some = views()
    some += (np.arange(len(some)) * 0.03)[:, None, None, None] * [1.0, 0.0, 0.0]
    assert detect(some) is None


@pytest.mark.parametrize(("angle_deg", "is_one"), [(50.0, True), (70.0, False)])
def test_an_elbow_may_be_bent_more_than_other_joints(angle_deg, is_one):
    joints = standing(1)
    raise_limb(joints, "left_elbow", ["left_hand"], np.radians([angle_deg]), False)
    assert is_n_pose(joints[0]) is is_one
    raise_limb(joints, "left_hip", ["left_knee", "left_foot"], np.radians([35.0]), False)
    assert not is_n_pose(joints[0])


def test_the_exact_n_pose_is_symmetric_with_the_observed_lengths():
    rng = np.random.default_rng(2)
    exact = standing(1)[0] - [0.0, 0.0, 0.95]
    joints = n_pose_joints(exact + rng.normal(0.0, 0.01, exact.shape))
    left = [index for name, index in JOINT_INDEX.items() if name.startswith("left_")]
    right = [index for name, index in JOINT_INDEX.items() if name.startswith("right_")]
    np.testing.assert_allclose(joints[right], joints[left] * [1.0, -1.0, 1.0])
    np.testing.assert_allclose(n_pose_joints(exact), exact, atol=1e-12)
    np.testing.assert_allclose(joints, exact, atol=0.04)
