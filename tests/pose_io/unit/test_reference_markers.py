import numpy as np
import pytest

from pose_core.body.joint_angles import joint_angles
from pose_core.errors import InputError
from pose_core.joints import JOINT_INDEX
from pose_io.references.markers import KNEE_OFFSET_M, MarkerSeries, plain, skeleton_of_markers

STANDING = {  # x forward, y left, z up [m]
    "LASI": (0.05, 0.12, 1.00),
    "RASI": (0.05, -0.12, 1.00),
    "LPSI": (-0.10, 0.04, 1.00),
    "RPSI": (-0.10, -0.04, 1.00),
    "C7": (-0.06, 0.0, 1.50),
    "CLAV": (0.06, 0.0, 1.42),
    "STRN": (0.10, 0.0, 1.25),
    "T10": (-0.10, 0.0, 1.25),
    "LFHD": (0.1, 0.07, 1.7),
    "RFHD": (0.1, -0.07, 1.7),
    "LBHD": (-0.1, 0.07, 1.7),
    "RBHD": (-0.1, -0.07, 1.7),
    "LSHO": (0.0, 0.20, 1.45),
    "RSHO": (0.0, -0.20, 1.45),
    "LELB": (0.0, 0.25, 1.15),
    "RELB": (0.0, -0.25, 1.15),
    "LWRA": (0.02, 0.25, 0.90),
    "LWRB": (-0.02, 0.25, 0.90),
    "RWRA": (0.02, -0.25, 0.90),
    "RWRB": (-0.02, -0.25, 0.90),
    "LKNE": (0.0, 0.15, 0.50),
    "RKNE": (0.0, -0.15, 0.50),
    "LANK": (0.0, 0.14, 0.08),
    "RANK": (0.0, -0.14, 0.08),
}


def series(points, count=3):
    return MarkerSeries(
        stamps_ns=np.arange(count) * 10_000_000,
        positions={plain(name): np.tile(point, (count, 1)) for name, point in points.items()},
    )


def joint(points, name):
    return skeleton_of_markers(series(points), "test").positions[0, JOINT_INDEX[name]]


def test_labels_lose_their_subject_and_their_punctuation():
    assert plain("Subject 1:L_ASI") == "lasi"


@pytest.mark.parametrize("factor", [1000.0, 10.0, 0.1, 0.001])
def test_markers_in_another_unit_than_stated_are_refused(factor):
    points = {name: tuple(factor * np.array(point)) for name, point in STANDING.items()}
    joints = {"left_hip": points["LASI"], "right_hip": points["RASI"], "neck": points["C7"]}
    with pytest.raises(
        InputError, match=r"test: hips and neck are .* m apart, .* unit that it sta"
    ):
        skeleton_of_markers(series(joints), "test")


def test_hips_lie_where_the_regression_puts_them():
    # Pelvis 240 mm wide and 150 mm deep: Harrington's −0.24 · 150 − 9.9 = −45.9 mm forward of the
    # middle of the ASIS, −0.30 · 240 − 10.9 = −82.9 mm up, 0.33 · 240 + 7.3 = 86.5 mm aside.
    np.testing.assert_allclose(joint(STANDING, "left_hip"), [0.0041, 0.0865, 0.9171], atol=1e-9)
    np.testing.assert_allclose(joint(STANDING, "right_hip"), [0.0041, -0.0865, 0.9171], atol=1e-9)


def test_one_sacral_marker_does_for_two():
    points = {name: p for name, p in STANDING.items() if "PSI" not in name}
    points["SACR"] = (-0.10, 0.0, 1.0)
    np.testing.assert_allclose(joint(points, "left_hip"), joint(STANDING, "left_hip"))


def test_neck_head_torso_and_wrists_are_between_their_markers():
    np.testing.assert_allclose(joint(STANDING, "neck"), [0.0, 0.0, 1.46])
    np.testing.assert_allclose(joint(STANDING, "head"), [0.0, 0.0, 1.7], atol=1e-12)
    np.testing.assert_allclose(joint(STANDING, "torso"), [0.0, 0.0, 1.25])
    np.testing.assert_allclose(joint(STANDING, "right_hand"), [0.0, -0.25, 0.90])


def test_shoulders_lie_below_the_acromia():
    below = np.array(STANDING["LSHO"]) - joint(STANDING, "left_shoulder")
    assert np.linalg.norm(below) == pytest.approx(0.17 * 0.40)
    assert below[2] > 0.9 * np.linalg.norm(below)


def test_the_knee_is_inside_of_its_marker_at_a_right_angle():
    knee, hip = joint(STANDING, "left_knee"), joint(STANDING, "left_hip")
    to_marker, to_hip = np.array(STANDING["LKNE"]) - knee, hip - knee
    assert np.linalg.norm(to_marker) == pytest.approx(KNEE_OFFSET_M)
    assert to_marker @ to_hip == pytest.approx(0.0, abs=1e-12)
    assert knee[1] < STANDING["LKNE"][1]
    assert joint(STANDING, "right_knee")[1] > STANDING["RKNE"][1]


def test_the_thigh_wand_determines_the_knee_axis():
    in_front = STANDING | {"LTHI": (0.2, 0.13, 0.7)}
    assert joint(in_front, "left_knee")[0] < -0.03
    assert joint(STANDING, "left_knee")[0] == pytest.approx(0.0, abs=0.01)


def test_a_medial_marker_makes_the_knee_the_middle_of_both():
    both = STANDING | {"LKNM": (0.0, 0.05, 0.52)}
    np.testing.assert_allclose(joint(both, "left_knee"), [0.0, 0.10, 0.51])


def test_a_joint_centre_in_the_file_wins_over_markers():
    named = STANDING | {"LKJC": (0.0, 0.09, 0.5), "RFEO": (0.0, -0.09, 0.5)}
    np.testing.assert_allclose(joint(named, "left_knee"), [0.0, 0.09, 0.5])
    np.testing.assert_allclose(joint(named, "right_knee"), [0.0, -0.09, 0.5])


def test_standing_upright_the_legs_are_nearly_straight():
    angles = joint_angles(skeleton_of_markers(series(STANDING), "test").positions)
    legs = [values[0] for name, values in angles.items() if "hip" in name or "knee" in name]
    assert np.degrees(np.abs(legs)).max() < 10.0


def test_without_arms_the_legs_are_known():
    legs = {name: p for name, p in STANDING.items() if name[1:] not in ("ELB", "WRA", "WRB")}
    angles = joint_angles(skeleton_of_markers(series(legs), "test").positions)
    assert np.isfinite(angles["left_knee_flexion"]).all()
    assert np.isnan(angles["left_elbow_flexion"]).all()


def test_without_a_pelvis_missing_markers_are_named():
    points = {name: p for name, p in STANDING.items() if "ASI" not in name}
    with pytest.raises(InputError, match="left_hip and right_hip cannot be found: expected"):
        skeleton_of_markers(series(points), "trial.c3d")
