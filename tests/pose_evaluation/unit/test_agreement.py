import numpy as np
import pytest
from moving_body import motion
from scipy.spatial.transform import Rotation

from pose_core.body.joint_angles import ANGLES
from pose_core.joints import JOINT_INDEX
from pose_evaluation.agreement import measure_agreement, measure_stability

TURN = Rotation.from_rotvec([0.0, 0.0, 0.4]).as_matrix()


@pytest.fixture
def right_in_left():
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = TURN, (0.3, 0.0, 0.0)
    return T


@pytest.fixture
def views(right_in_left):
    left = motion(rate=30.0)
    right = motion(rate=30.0, begin_s=0.010).transformed(np.linalg.inv(right_in_left))
    return {"left": left, "right": right}


def test_calibrated_views_of_one_body_agree(views, right_in_left):
    (view,) = measure_agreement(views, {"left": np.eye(4), "right": right_in_left})
    assert (view.first, view.second) == ("left", "right")
    assert view.calibrated_cm < 0.2
    assert view.best_rigid_cm < 0.2
    assert view.as_logged_cm > 20.0


def test_no_extrinsics_give_no_calibrated_distance(views):
    (view,) = measure_agreement(views, {})
    assert np.isnan(view.calibrated_cm)
    assert np.isfinite(view.as_logged_cm)


def test_the_distance_is_the_offset_of_the_joints(views):
    away = np.eye(4)
    away[:3, 3] = 0.03, 0.04, 0.0
    views["right"] = views["left"].transformed(away)
    (view,) = measure_agreement(views, {})
    assert view.as_logged_cm == pytest.approx(5.0)
    assert view.best_rigid_cm == pytest.approx(0.0, abs=1e-6)


def test_the_angles_of_two_views_are_compared(views):
    (view,) = measure_agreement(views, {})
    assert set(view.angle_difference_deg) == set(ANGLES)
    assert max(view.angle_difference_deg.values()) < 1.0


def test_a_knee_seen_differently_shows_in_its_angle_alone(views):
    views["right"].positions[:, JOINT_INDEX["left_foot"], 0] += 0.1
    (view,) = measure_agreement(views, {})
    wrong = {name for name, deg in view.angle_difference_deg.items() if deg > 2.0}
    assert wrong == {"left_knee_flexion"}


def test_views_that_never_meet_have_no_distance(views):
    views["right"] = views["right"].shifted(100.0)
    (view,) = measure_agreement(views, {})
    assert view.frames == 0
    assert np.isnan([view.as_logged_cm, view.best_rigid_cm]).all()


def test_every_pair_of_three_sensors_is_compared(views):
    views["top"] = views["left"]
    pairs = [(v.first, v.second) for v in measure_agreement(views, {})]
    assert pairs == [("left", "right"), ("left", "top"), ("right", "top")]


def test_fused_and_mean_are_methods_not_views(views):
    views["mean"] = views["fused"] = views["left"]
    assert len(measure_agreement(views, {})) == 1


def test_a_silence_is_a_gap_and_a_dropped_frame_is_not():
    series = motion(rate=30.0, duration_s=10.0)
    keep = np.ones(len(series), bool)
    keep[100] = False
    keep[200:215] = False
    thinned = type(series)(
        stamps_ns=series.stamps_ns[keep],
        positions=series.positions[keep],
        tracking_state=series.tracking_state[keep],
    )
    stability = measure_stability(thinned)
    assert stability.gaps == 1
    assert stability.longest_gap_s == pytest.approx(16 / 30.0, abs=0.001)


def test_a_stretched_bone_shows_in_its_variation():
    series = motion(rate=30.0)
    series.positions[::2, JOINT_INDEX["head"], 2] += 0.02
    stability = measure_stability(series)
    assert stability.bone_sd_mm["neck"] == pytest.approx(10.0, rel=0.01)
    assert stability.bone_sd_mm["left_thigh"] == pytest.approx(0.0, abs=1e-6)
