import numpy as np
import pytest
from moving_body import motion, raise_limb, standing
from scipy.spatial.transform import Rotation

from pose_core.body.joint_angles import ANGLES
from pose_core.errors import InputError
from pose_core.joints import JOINT_INDEX
from pose_evaluation.scores import (
    common_window,
    evaluate,
    joint_errors_mm,
    score_angle,
    score_method,
)
from pose_evaluation.time_shift import estimate_time_shift
from pose_io.references.reference import reference_of_skeleton


def truth(**kind):
    return reference_of_skeleton("truth", motion(**kind))


@pytest.mark.parametrize("shift_s", [0.0437, -0.1212, 0.0])
def test_a_time_shift_is_found_below_the_frame_period(shift_s):
    method = motion(rate=30.0, duration_s=11.0, begin_s=0.5).shifted(shift_s)
    assert estimate_time_shift(method, motion()) == pytest.approx(shift_s, abs=0.001)


def test_a_time_shift_is_found_in_spite_of_noise_bias_and_gaps():
    method = motion(rate=30.0, duration_s=11.0, begin_s=0.5).shifted(0.08)
    method.positions[:] += np.random.default_rng(1).normal(0.0, 0.01, method.positions.shape)
    method.positions[:, JOINT_INDEX["left_foot"]] += 0.1
    method.positions[100:130] = np.nan
    assert estimate_time_shift(method, motion()) == pytest.approx(0.08, abs=0.005)


def test_someone_who_stands_still_has_no_time_shift():
    still = motion()
    still.positions[:] = standing(len(still))
    assert estimate_time_shift(still, still) == 0.0


def test_a_steady_ramp_that_fits_at_every_shift_has_none():
    ramp = motion(rate=50.0)
    ramp.positions[:] = standing(len(ramp))
    angle = np.linspace(0.0, 1.0, len(ramp))
    raise_limb(ramp.positions, "left_hip", ["left_knee", "left_foot"], angle, abduct=True)
    assert estimate_time_shift(ramp, ramp) == pytest.approx(0.0, abs=0.005)


def test_recordings_apart_in_time_have_no_time_shift():
    assert estimate_time_shift(motion(begin_s=100.0), motion()) == 0.0


def test_a_perfect_method_has_no_error():
    scores = score_method("perfect", motion(rate=50.0), truth(rate=50.0))
    assert scores.mean_rmse_deg == pytest.approx(0.0, abs=1e-6)
    assert scores.mpjpe_mm == pytest.approx(0.0, abs=1e-6)
    assert scores.mean_r == pytest.approx(1.0)
    assert scores.coverage == 1.0


def test_the_frame_and_the_delay_of_a_method_do_not_count():
    away = np.eye(4)
    away[:3, :3] = Rotation.random(random_state=3).as_matrix()
    away[:3, 3] = 5.0, -3.0, 2.0
    scores = score_method("far", motion(rate=100.0).transformed(away).shifted(0.15), truth())
    assert scores.shift_s == pytest.approx(0.15, abs=0.001)
    assert scores.mean_rmse_deg < 0.1
    assert scores.mpjpe_mm < 1.0


def test_a_constant_offset_is_bias_and_leaves_the_correlation():
    expected = np.sin(np.linspace(0.0, 20.0, 500))
    score = score_angle(expected + np.radians(7.0), expected)
    assert score.bias_deg == pytest.approx(7.0)
    assert score.rmse_deg == pytest.approx(7.0)
    assert score.r == pytest.approx(1.0)


def test_errors_are_taken_modulo_a_full_turn():
    expected = np.radians(np.linspace(150.0, 210.0, 100))
    found = (expected + np.radians(3.0) + np.pi) % (2.0 * np.pi) - np.pi
    score = score_angle(found, (expected + np.pi) % (2.0 * np.pi) - np.pi)
    assert score.rmse_deg == pytest.approx(3.0)
    assert score.r == pytest.approx(1.0)


def test_rmse_has_the_noise_s_size():
    expected = np.sin(np.linspace(0.0, 20.0, 20_000))
    noise = np.radians(np.random.default_rng(2).normal(0.0, 4.0, len(expected)))
    score = score_angle(expected + noise, expected)
    assert score.rmse_deg == pytest.approx(4.0, rel=0.03)
    assert score.bias_deg == pytest.approx(0.0, abs=0.1)


def test_unknown_instants_are_left_out_and_counted():
    expected = np.sin(np.linspace(0.0, 20.0, 100))
    found = expected.copy()
    found[10:40] = np.nan
    score = score_angle(found, expected)
    assert score.samples == 70
    assert score.rmse_deg == pytest.approx(0.0, abs=1e-9)


def test_an_angle_never_seen_has_no_score():
    score = score_angle(np.full(50, np.nan), np.linspace(0.0, 1.0, 50))
    assert np.isnan([score.r, score.rmse_deg, score.bias_deg]).all()
    assert score.samples == 0


def test_an_angle_that_does_not_move_has_no_correlation():
    noise = np.random.default_rng(4).normal(0.0, 0.05, 300)
    score = score_angle(noise, np.zeros(300))
    assert np.isnan(score.r)
    assert score.rmse_deg > 0.0


def test_flexion_is_left_out_while_the_reference_points_sideways():
    reference = motion(rate=50.0)
    abduction = np.radians(np.linspace(0.0, 90.0, len(reference)))
    reference.positions[:] = standing(len(reference))
    raise_limb(
        reference.positions, "left_shoulder", ["left_elbow", "left_hand"], abduction, abduct=True
    )
    scores = score_method("same", reference, reference_of_skeleton("truth", reference))
    below = int((np.degrees(abduction) <= 60.0).sum())
    assert scores.angles["left_shoulder_flexion"].samples == below
    assert scores.angles["left_shoulder_abduction"].samples == len(reference)
    assert scores.angles["left_elbow_flexion"].samples == len(reference)


def test_one_wrong_joint_is_one_joint_s_error():
    reference = motion(rate=50.0)
    wrong = reference.positions.copy()
    wrong[::2, JOINT_INDEX["left_hand"], 2] += 0.2
    wrong[1::2, JOINT_INDEX["left_hand"], 2] -= 0.2
    errors = joint_errors_mm(wrong, reference.positions)
    assert errors["left_hand"] == pytest.approx(200.0, rel=0.02)
    assert errors["right_knee"] < 10.0


def test_methods_are_compared_over_the_time_they_have_in_common():
    early, late = motion(duration_s=8.0), motion(duration_s=9.0, begin_s=3.0)
    evaluation = evaluate({"early": early, "late": late}, truth())
    assert evaluation.duration_s == pytest.approx(5.0, abs=0.05)
    assert evaluation.method("late").coverage == pytest.approx(1.0, abs=0.01)
    assert set(evaluation.method("early").angles) == set(ANGLES)


def test_gaps_of_a_method_lower_its_coverage():
    method = motion(rate=30.0)
    method.positions[100:200] = np.nan
    scores = score_method("gappy", method, truth(rate=50.0))
    assert scores.coverage == pytest.approx(1.0 - 100 / len(method), abs=0.03)


def test_recordings_without_overlap_are_refused():
    with pytest.raises(InputError, match=r"do not overlap.*fused 20\.0 to 32\.0 s"):
        common_window(truth(), {"fused": motion(begin_s=20.0)})


def test_a_method_without_skeletons_is_refused_by_name():
    nothing = motion().between(-2, -1)
    with pytest.raises(InputError, match="fused has no skeletons"):
        common_window(truth(), {"fused": nothing})
