import numpy as np
import pytest
from moving_body import motion

from pose_fusion.body.joint_angles import joint_angles
from pose_fusion.evaluation.agreement import angle_differences_deg
from pose_fusion.evaluation.angle_series import AngleSeries, angle_series
from pose_fusion.evaluation.limb_attitude import limb_attitude
from pose_fusion.evaluation.scores import AngleScore, evaluate, score_angle
from pose_fusion.evaluation.uncertainty import mean_coverage, uncertainty_coverage
from pose_fusion.streams.bags import EstimateSeries

KNEE = "right_knee_flexion"


def estimates(series, stddev_deg, name=KNEE):
    count = len(series)
    position = joint_angles(series.positions)[name][:, None]
    ones = np.ones((count, 1))
    return EstimateSeries(
        stamps_ns=series.stamps_ns,
        names=(name,),
        position=position,
        position_stddev=np.radians(stddev_deg) * ones,
        weight_kinect=ones,
        weight_imu=0.0 * ones,
        source=np.ones((count, 1), np.uint8),
        latency_s=np.zeros(count),
    )


def truth_beside(series, error_deg):
    """The angles of a series, from which it is off by given errors."""
    known = dict(angle_series(series).angles)
    known[KNEE] = known[KNEE] + np.radians(error_deg)
    return AngleSeries(stamps_ns=series.stamps_ns, angles=known)


def test_errors_as_large_as_published_lie_within_as_often_as_a_normal_s():
    series = motion(rate=100.0, duration_s=60.0)
    error = np.random.default_rng(1).normal(0.0, 3.0, len(series))
    found = uncertainty_coverage(series, estimates(series, 3.0), truth_beside(series, error), 0.0)[
        KNEE
    ]
    assert found.within_1 == pytest.approx(0.683, abs=0.02)
    assert found.within_2 == pytest.approx(0.954, abs=0.01)
    assert found.mean_stddev_deg == pytest.approx(3.0)
    assert found.samples == len(series)


def test_a_boaster_s_errors_lie_outside():
    series = motion(rate=30.0)
    error = np.where(np.arange(len(series)) % 4 == 0, 1.5, 5.0)
    found = uncertainty_coverage(series, estimates(series, 1.0), truth_beside(series, error), 0.0)[
        KNEE
    ]
    assert found.within_1 == 0.0
    assert found.within_2 == pytest.approx(0.25)


def test_a_method_s_own_lag_is_taken_out():
    series = motion(rate=100.0)
    late = series.shifted(0.1)
    found = uncertainty_coverage(late, estimates(late, 0.5), angle_series(series), 0.1)[KNEE]
    assert found.within_1 == 1.0


def test_the_mean_of_two_angles_counts_their_instants():
    few, many = motion(rate=10.0, duration_s=4.0), motion(rate=30.0, duration_s=4.0)
    coverage = {
        "few": uncertainty_coverage(few, estimates(few, 1.0), truth_beside(few, 9.0), 0.0)[KNEE],
        "many": uncertainty_coverage(many, estimates(many, 1.0), truth_beside(many, 0.1), 0.0)[
            KNEE
        ],
    }
    mean = mean_coverage(coverage)
    assert mean.samples == len(few) + len(many)
    assert mean.within_1 == pytest.approx(len(many) / (len(few) + len(many)))


def test_limits_of_agreement_are_those_of_the_book():
    # Differences 1, 3, 5: mean 3, standard deviation 2 with n − 1.
    expected = np.radians([0.0, 20.0, 40.0])
    score = score_angle(expected + np.radians([1.0, 3.0, 5.0]), expected)
    assert score.sd_deg == pytest.approx(2.0)
    assert score.limits_of_agreement_deg == pytest.approx((3.0 - 3.92, 3.0 + 3.92))


def test_one_difference_has_no_limits():
    score = AngleScore(r=np.nan, rmse_deg=np.nan, bias_deg=np.nan, samples=1)
    assert np.isnan(score.limits_of_agreement_deg).all()


def test_a_reference_of_angles_alone_gives_scores_of_angles_alone():
    series = motion(rate=30.0)
    reference = truth_beside(motion(rate=100.0), 0.0)
    reference.angles[KNEE][:] -= np.radians(2.0)
    scores = evaluate({"fused": series}, reference, reference_name="a .mot").method("fused")
    assert scores.angles[KNEE].bias_deg == pytest.approx(2.0, abs=0.05)
    assert scores.angles["left_hip_abduction"].rmse_deg == pytest.approx(0.0, abs=0.1)
    assert np.isnan(scores.mpjpe_mm)


def test_methods_differ_by_their_mean_rms_difference():
    first = angle_series(motion(rate=30.0))
    second = truth_beside(motion(rate=30.0), 12.0)
    differences = angle_differences_deg({"a": first, "b": second})
    assert differences["a", "b"] == pytest.approx(12.0 / 12, rel=0.01)  # one of twelve angles
    assert differences["b", "a"] == differences["a", "b"]


def test_a_hanging_arm_has_no_yaw_and_an_arm_in_front_points_ahead():
    positions = np.zeros((2, 15, 3))
    positions[0, 4] = [0.0, 0.0, -0.3]  # left elbow below the shoulder
    positions[1, 4] = [0.0, 0.3, 0.0]  # to the left
    pitch, yaw = np.degrees(limb_attitude(positions, "left_upper_arm"))
    assert pitch == pytest.approx([-90.0, 0.0])
    assert np.isnan(yaw[0])
    assert yaw[1] == pytest.approx(90.0)
