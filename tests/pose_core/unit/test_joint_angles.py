import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pose_core.body.joint_angles import ANGLES, joint_angles, unwrapped, wrapped
from pose_core.joints import JOINT_INDEX, JOINTS, SIDES

NEUTRAL = {
    "head": (0.0, 0.0, 1.7),
    "neck": (0.0, 0.0, 1.5),
    "torso": (0.0, 0.0, 1.2),
    "shoulder": (0.0, 0.2, 1.45),
    "elbow": (0.0, 0.2, 1.15),
    "hand": (0.0, 0.2, 0.9),
    "hip": (0.0, 0.1, 0.95),
    "knee": (0.0, 0.1, 0.5),
    "foot": (0.0, 0.1, 0.1),
}


def neutral():
    """Standing in `map`: x forward, y left, z up."""
    skeleton = np.zeros((15, 3))
    for name, index in JOINT_INDEX.items():
        side, _, joint = name.partition("_")
        if side in SIDES:
            skeleton[index] = NEUTRAL[joint]
            skeleton[index, 1] *= 1.0 if side == "left" else -1.0
        else:
            skeleton[index] = NEUTRAL[name]
    return skeleton


def turned(skeleton, pivot, joints, axis, degrees):
    """The skeleton with some joints turned about a pivot."""
    turn = Rotation.from_rotvec(np.radians(degrees) * np.array(axis, float))
    moved = skeleton.copy()
    centre = skeleton[JOINT_INDEX[pivot]]
    for joint in joints:
        index = JOINT_INDEX[joint]
        moved[index] = centre + turn.apply(skeleton[index] - centre)
    return moved


def degrees_of(skeleton):
    return {name: np.degrees(angle[0]) for name, angle in joint_angles(skeleton[None]).items()}


def assert_only(skeleton, **expected):
    found = degrees_of(skeleton)
    assert found == pytest.approx({name: expected.get(name, 0.0) for name in ANGLES}, abs=1e-9)


def test_the_neutral_pose_has_no_angles():
    assert_only(neutral())


@pytest.mark.parametrize("side", SIDES)
def test_a_leg_lifted_sideways_is_abduction(side):
    outward = 1.0 if side == "left" else -1.0
    leg = [f"{side}_knee", f"{side}_foot"]
    # About +x, what hangs along −z swings to +y, the left.
    skeleton = turned(neutral(), f"{side}_hip", leg, (1, 0, 0), 30.0 * outward)
    assert_only(skeleton, **{f"{side}_hip_abduction": 30.0})


@pytest.mark.parametrize("side", SIDES)
def test_a_thigh_raised_in_front_is_hip_flexion(side):
    leg = [f"{side}_knee", f"{side}_foot"]
    # About −y, what hangs along −z swings to +x, forward.
    skeleton = turned(neutral(), f"{side}_hip", leg, (0, -1, 0), 70.0)
    assert_only(skeleton, **{f"{side}_hip_flexion": 70.0})


@pytest.mark.parametrize("side", SIDES)
def test_a_heel_raised_behind_is_knee_flexion(side):
    skeleton = turned(neutral(), f"{side}_knee", [f"{side}_foot"], (0, 1, 0), 80.0)
    assert_only(skeleton, **{f"{side}_knee_flexion": 80.0})


@pytest.mark.parametrize("side", SIDES)
def test_an_arm_raised_sideways_is_shoulder_abduction(side):
    outward = 1.0 if side == "left" else -1.0
    arm = [f"{side}_elbow", f"{side}_hand"]
    skeleton = turned(neutral(), f"{side}_shoulder", arm, (1, 0, 0), 50.0 * outward)
    assert_only(skeleton, **{f"{side}_shoulder_abduction": 50.0})


@pytest.mark.parametrize("degrees", [45.0, 90.0, 170.0])
def test_an_arm_raised_in_front_is_shoulder_flexion_up_to_overhead(degrees):
    arm = ["right_elbow", "right_hand"]
    skeleton = turned(neutral(), "right_shoulder", arm, (0, -1, 0), degrees)
    assert_only(skeleton, right_shoulder_flexion=degrees)


def test_an_arm_raised_backwards_is_negative_shoulder_flexion():
    arm = ["left_elbow", "left_hand"]
    skeleton = turned(neutral(), "left_shoulder", arm, (0, 1, 0), 20.0)
    assert_only(skeleton, left_shoulder_flexion=-20.0)


def test_a_bent_forearm_is_elbow_flexion():
    skeleton = turned(neutral(), "left_elbow", ["left_hand"], (0, -1, 0), 120.0)
    assert_only(skeleton, left_elbow_flexion=120.0)


def test_flexion_followed_by_abduction_is_recovered():
    # docs/conventions.md: a limb points to (sin f cos a, ±sin a, −cos f cos a).
    flexion, abduction = np.radians(40.0), np.radians(25.0)
    direction = np.array(
        [
            np.sin(flexion) * np.cos(abduction),
            -np.sin(abduction),
            -np.cos(flexion) * np.cos(abduction),
        ]
    )
    skeleton = neutral()
    for joint, length in (("right_knee", 0.45), ("right_foot", 0.85)):
        skeleton[JOINT_INDEX[joint]] = skeleton[JOINT_INDEX["right_hip"]] + length * direction
    assert_only(skeleton, right_hip_flexion=40.0, right_hip_abduction=25.0)


def test_a_forward_lean_of_the_trunk_flexes_the_hips():
    upper = [name for name in JOINTS if not name.endswith(("hip", "knee", "foot"))]
    skeleton = neutral()
    middle = 0.5 * (skeleton[JOINT_INDEX["left_hip"]] + skeleton[JOINT_INDEX["right_hip"]])
    turn = Rotation.from_rotvec([0.0, np.radians(35.0), 0.0])
    for name in upper:
        skeleton[JOINT_INDEX[name]] = middle + turn.apply(skeleton[JOINT_INDEX[name]] - middle)
    assert_only(skeleton, left_hip_flexion=35.0, right_hip_flexion=35.0)


def test_a_missing_joint_makes_only_its_own_angles_unknown():
    skeleton = neutral()
    skeleton[JOINT_INDEX["left_foot"]] = np.nan
    unknown = {name for name, angle in degrees_of(skeleton).items() if np.isnan(angle)}
    assert unknown == {"left_knee_flexion"}


def test_a_missing_hip_makes_all_but_the_hinges_unknown():
    skeleton = neutral()
    skeleton[JOINT_INDEX["left_hip"]] = np.nan
    known = {name for name, angle in degrees_of(skeleton).items() if np.isfinite(angle)}
    assert known == {"right_knee_flexion", "left_elbow_flexion", "right_elbow_flexion"}


def test_coinciding_joints_give_nan_and_no_warning():
    with np.errstate(all="raise"):
        angles = joint_angles(np.zeros((2, 15, 3)))
    assert all(np.isnan(angle).all() for angle in angles.values())


def test_no_frames_give_no_angles():
    assert {len(angle) for angle in joint_angles(np.zeros((0, 15, 3))).values()} == {0}


def test_wrapped_differences_are_the_shortest():
    assert wrapped(np.radians([350.0, -350.0, 10.0])) == pytest.approx(np.radians([-10, 10, 10]))


def test_unwrapping_skips_missing_instants():
    angle = np.radians([170.0, np.nan, -170.0, np.nan, 160.0])
    assert np.degrees(unwrapped(angle)) == pytest.approx(
        [170, np.nan, 190, np.nan, 160], nan_ok=True
    )
