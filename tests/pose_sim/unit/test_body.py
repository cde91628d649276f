import numpy as np
import pytest

from pose_core.api import joint_angles
from pose_core.joints import JOINT_INDEX, SEGMENTS, SIDES
from pose_sim.body import BODY_ANGLES, SHANK, THIGH, UPPER_ARM, Body, neutral_angles

BODY = Body(1.80)
RIGID = [
    (f"{side}_{a}", f"{side}_{b}")
    for side in SIDES
    for a, b in (("hip", "knee"), ("knee", "foot"), ("shoulder", "elbow"), ("elbow", "hand"))
] + [("left_hip", "right_hip"), ("neck", "head")]


def posed(**degrees: float):
    angles = neutral_angles(1)
    for name, value in degrees.items():
        angles[name] = np.radians([value])
    return BODY.pose(angles)


def measured(**degrees: float) -> dict[str, float]:
    angles = joint_angles(posed(**degrees).joints)
    return {name: float(np.degrees(value[0])) for name, value in angles.items()}


def distance(joints: np.ndarray, a: str, b: str) -> np.ndarray:
    return np.linalg.norm(joints[:, JOINT_INDEX[a]] - joints[:, JOINT_INDEX[b]], axis=-1)


def test_bone_lengths_stay_whatever_the_body_does():
    rng = np.random.default_rng(3)
    angles = {name: rng.uniform(-1.5, 1.5, 200) for name in BODY_ANGLES}
    joints = BODY.pose(angles).joints
    for a, b in RIGID:
        assert np.ptp(distance(joints, a, b)) < 1e-12, (a, b)


def test_bone_lengths_follow_the_height():
    joints = BODY.pose(neutral_angles(1)).joints
    assert distance(joints, "left_hip", "left_knee")[0] == pytest.approx(1.80 * THIGH)
    assert distance(joints, "right_knee", "right_foot")[0] == pytest.approx(1.80 * SHANK)
    assert distance(joints, "left_shoulder", "left_elbow")[0] == pytest.approx(1.80 * UPPER_ARM)


def test_all_measured_angles_are_zero_in_the_neutral_pose():
    assert np.allclose(list(measured().values()), 0.0, atol=1e-6)


def test_all_segments_are_parallel_to_map_in_the_neutral_pose():
    pose = posed()
    assert set(pose.rotations) == set(SEGMENTS)
    for rotation in pose.rotations.values():
        assert np.allclose(rotation, np.eye(3))


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize(
    ("joint", "degrees"),
    [
        ("hip_abduction", 35.0),
        ("hip_flexion", 70.0),
        ("hip_flexion", -15.0),
        ("knee_flexion", 90.0),
        ("shoulder_abduction", 60.0),
        ("shoulder_flexion", 120.0),
        ("elbow_flexion", 80.0),
    ],
)
def test_a_joint_turned_alone_measures_what_it_was_turned_by(side, joint, degrees):
    name = f"{side}_{joint}"
    angles = measured(**{name: degrees})
    assert angles[name] == pytest.approx(degrees, abs=1e-6)
    others = [value for other, value in angles.items() if other != name]
    assert np.allclose(others, 0.0, atol=1e-5)


def test_flexion_and_abduction_together_measure_as_turned():
    angles = measured(left_hip_flexion=50.0, left_hip_abduction=25.0, left_hip_rotation=20.0)
    assert angles["left_hip_flexion"] == pytest.approx(50.0)
    assert angles["left_hip_abduction"] == pytest.approx(25.0)


def test_the_left_leg_lifted_sideways_goes_to_the_left():
    joints = posed(left_hip_abduction=40.0).joints[0]
    assert joints[JOINT_INDEX["left_foot"], 1] > joints[JOINT_INDEX["left_hip"], 1] + 0.4


def test_a_bent_knee_swings_the_foot_back_and_a_bent_elbow_the_hand_forward():
    joints = posed(left_knee_flexion=60.0, left_elbow_flexion=60.0).joints[0]
    assert joints[JOINT_INDEX["left_foot"], 0] < -0.3
    assert joints[JOINT_INDEX["left_hand"], 0] > 0.2


@pytest.mark.parametrize(("side", "outward"), [("left", 1.0), ("right", -1.0)])
def test_an_inward_rotation_turns_a_bent_forearm_to_the_midline(side, outward):
    bent = {f"{side}_elbow_flexion": 90.0, f"{side}_shoulder_rotation": 30.0}
    joints = posed(**bent).joints[0]
    hand, elbow = (joints[JOINT_INDEX[f"{side}_{name}"]] for name in ("hand", "elbow"))
    assert outward * (hand - elbow)[1] < -0.1


def test_the_spine_bends_in_more_than_one_place():
    straight = distance(posed().joints, "neck", "torso")[0]
    upper = posed(thoracic_flexion=40.0)
    lower = posed(lumbar_flexion=40.0)
    torso = JOINT_INDEX["torso"]
    assert np.linalg.norm(upper.joints[0, torso] - posed().joints[0, torso]) < 0.03
    assert np.linalg.norm(lower.joints[0, torso] - posed().joints[0, torso]) > 0.08
    assert distance(lower.joints, "neck", "torso")[0] == pytest.approx(straight, abs=1e-9)


def test_an_elevated_clavicle_lifts_the_shoulder_and_leaves_the_arm_hanging():
    pose = posed(left_clavicle_elevation=20.0)
    lift = pose.joints[0, JOINT_INDEX["left_shoulder"], 2]
    lift -= posed().joints[0, JOINT_INDEX["left_shoulder"], 2]
    assert 0.04 < lift < 0.09
    assert np.allclose(pose.rotations["left_upper_arm"], np.eye(3))


def test_feet_stay_level_when_the_knees_bend():
    pose = posed(left_hip_flexion=40.0, left_knee_flexion=70.0, pelvis_tilt=10.0)
    assert np.allclose(pose.rotations["left_foot"], np.eye(3), atol=1e-12)
