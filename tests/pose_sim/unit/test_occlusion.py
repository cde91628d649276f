import numpy as np
import pytest

from pose_core.joints import JOINT_INDEX, JOINTS
from pose_sim.body import Body, neutral_angles
from pose_sim.occlusion import hidden

BODY = Body(1.75)
FRONT, BACK, LEFT = np.array([2.2, 0.0, 0.4]), np.array([-2.2, 0.0, 0.4]), np.array([0.0, 2.2, 0.4])


def seen_from(camera, **degrees):
    angles = neutral_angles(1)
    for name, value in degrees.items():
        angles[name] = np.radians([value])
    blocked = hidden(BODY.pose(angles).joints, camera, BODY.height)[0]
    return dict(zip(JOINTS, blocked.tolist(), strict=True))


def test_every_joint_of_a_standing_body_is_in_view_from_the_front():
    assert max(seen_from(FRONT).values()) < 0.2


def test_a_hand_behind_the_trunk_is_hidden_from_the_front_and_not_from_the_back():
    behind = {
        "left_shoulder_flexion": -35.0,
        "left_elbow_flexion": 80.0,
        "left_shoulder_rotation": 85.0,
    }
    assert seen_from(FRONT, **behind)["left_hand"] > 0.9
    assert seen_from(BACK, **behind)["left_hand"] < 0.2


def test_from_the_left_the_body_hides_the_right_side():
    blocked = seen_from(LEFT)
    for joint in ("right_knee", "right_foot", "right_elbow"):
        assert blocked[joint] > 0.8, joint
    for joint in ("left_knee", "left_foot", "left_elbow"):
        assert blocked[joint] < 0.2, joint


def test_a_hand_before_the_chest_hides_what_is_behind_it():
    across = {"left_shoulder_flexion": 50.0, "left_elbow_flexion": 70.0}
    joints = BODY.pose({**neutral_angles(1), **{k: np.radians([v]) for k, v in across.items()}})
    hand = joints.joints[0, JOINT_INDEX["left_hand"]]
    shoulder = joints.joints[0, JOINT_INDEX["left_shoulder"]]
    camera = shoulder + 2.0 * (hand - shoulder) / np.linalg.norm(hand - shoulder)
    assert seen_from(camera, **across)["left_shoulder"] > 0.9


@pytest.mark.parametrize("shift", [np.zeros(3), np.array([3.0, -2.0, 1.0])])
def test_only_the_places_relative_to_the_camera_matter(shift):
    joints = BODY.pose(neutral_angles(1)).joints
    assert np.allclose(
        hidden(joints + shift, LEFT + shift, BODY.height), hidden(joints, LEFT, BODY.height)
    )
