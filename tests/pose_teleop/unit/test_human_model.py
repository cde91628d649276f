"""REP 155's joints give the same rotations of the segments."""

import numpy as np
import pytest
from followed_person import person_urdf

from pose_core.api import load_body_model
from pose_teleop.human_model import HumanAngles, human_urdf, joint_axes, joint_offsets

pin = pytest.importorskip("pinocchio")
NAMES = load_body_model("default").angle_names
FRAMES = {  # ours: theirs
    "left_forearm_subject": "l_elbow_person",
    "left_hand_joint_subject": "l_wrist_person",
    "right_hand_joint_subject": "r_wrist_person",
    "left_shank_subject": "l_knee_person",
    "left_foot_joint_subject": "l_ankle_person",
    "right_foot_joint_subject": "r_ankle_person",
}


def places(urdf, angles, frames):
    model = pin.buildModelFromXML(urdf)
    data = model.createData()
    q = pin.neutral(model)
    for name, angle in angles.items():
        q[model.joints[model.getJointId(name)].idx_q] = angle
    pin.framesForwardKinematics(model, data, q)
    found = [data.oMf[model.getFrameId(name, pin.FrameType.BODY)] for name in frames]
    return np.array([each.translation for each in found])


def their_angles(found):
    return {f"{name}_person": angle for name, angle in found.items()}


@pytest.mark.parametrize("seed", range(8))
def test_limbs_are_where_ours_are(seed):
    rng = np.random.default_rng(seed)
    angles = {n: rng.uniform(-0.8, 0.8) for n in NAMES}
    angles.update(waist_lateral_bending=0.0, waist_rotation=0.0)  # the model has no joint for them
    angles.update({n: abs(angles[n]) for n in NAMES if "knee" in n or "elbow" in n})
    urdf = human_urdf(joint_offsets(person_urdf(), "subject"), "person")

    ours = places(person_urdf(), angles, FRAMES)
    theirs = places(urdf, their_angles(HumanAngles().convert(angles)), FRAMES.values())

    np.testing.assert_allclose(theirs, ours, atol=2e-4)


def test_it_has_the_twenty_joints_of_the_model_in_its_order():
    found = HumanAngles().convert(dict.fromkeys(NAMES, 0.0))

    assert list(found) == list(joint_axes())
    assert len(found) == 20


def test_signs_are_the_models():
    angles = dict.fromkeys(NAMES, 0.0)
    angles.update(left_knee_flexion=0.5, right_elbow_flexion=0.4, waist_flexion=0.3)
    angles.update(right_hip_flexion=0.2, neck_flexion=0.1)

    found = HumanAngles().convert(angles)

    assert found["l_knee"] == pytest.approx(-0.5)
    assert found["r_elbow"] == pytest.approx(0.4)
    assert found["waist"] == pytest.approx(0.3)
    assert found["r_r_hip"] == pytest.approx(0.2)
    assert found["p_head"] == pytest.approx(-0.1)


def test_an_arm_that_is_raised_sideways_is_abducted():
    angles = {**dict.fromkeys(NAMES, 0.0), "left_shoulder_abduction": 1.0}

    found = HumanAngles().convert(angles)

    assert abs(found["l_p_shoulder"]) == pytest.approx(1.0)


def test_a_swinging_arm_makes_no_angle_step():
    converter, before = HumanAngles(), None
    for t in np.arange(0.0, 6.0, 0.01):
        angles = dict.fromkeys(NAMES, 0.0)
        angles["left_shoulder_flexion"] = 0.8 * np.sin(2.0 * t)
        angles["left_shoulder_abduction"] = 0.15 + 0.1 * np.sin(1.3 * t)
        found = np.array(list(converter.convert(angles).values()))
        if before is not None:
            assert np.abs(found - before).max() < 0.25
        before = found
