from dataclasses import replace

import numpy as np
import pytest

from pose_core.body.joint_angles import ANGLES
from pose_core.joints import JOINT_INDEX
from pose_core.streams.estimate_series import EstimateSeries
from pose_evaluation.range_of_motion import AngleRange
from pose_evaluation.scores import AngleScore, Evaluation, MethodScores
from pose_evaluation.stability import BONES
from pose_evaluation.table import nearest_zero, number, number_row
from pose_evaluation.uncertainty import Coverage
from pose_view.report.tables.accuracy import accuracy_tables, coverage_table, overview_table
from pose_view.report.tables.motion import peak_table, symmetry_table
from pose_view.report.tables.stability import source_table, timing_table


def scores(name, rmse, r=0.9, bias=0.0, error_mm=20.0):
    """A method with the same score in every angle, but for the first."""
    angle = AngleScore(r=r, rmse_deg=rmse, bias_deg=bias, samples=101)
    first = AngleScore(r=np.nan, rmse_deg=rmse + 12.0, bias_deg=bias, samples=101)
    return MethodScores(
        name=name,
        angles={a: first if a == ANGLES[0] else angle for a in ANGLES},
        joint_error_mm=dict.fromkeys(JOINT_INDEX, error_mm),
        bone_sd_mm=dict.fromkeys(BONES, 4.0),
        jerk=dict.fromkeys(JOINT_INDEX, 100.0),
        shift_s=0.05,
        coverage=0.98,
    )


def evaluation(*methods):
    return Evaluation(reference="truth", synthetic=True, duration_s=10.0, methods=methods)


def texts(table, name):
    """A line's cells, by its name; best ones with a star."""
    row = next(row for row in table.rows if row.name == name)
    return [cell.text + "*" * cell.is_best for cell in row.cells]


def test_the_overview_counts_the_angles_that_the_reference_has():
    whole = scores("default", 2.0)
    unknown = AngleScore(r=np.nan, rmse_deg=np.nan, bias_deg=np.nan, samples=0)
    knees = {a: s if "knee" in a else unknown for a, s in whole.angles.items()}
    some = overview_table(evaluation(replace(whole, angles=knees)))
    assert texts(overview_table(evaluation(whole)), "RMSE, mean of 12 angles [deg]") == ["3.0"]
    assert texts(some, "RMSE, mean of 2 angles [deg]") == ["2.0"]


@pytest.fixture
def tables():
    methods = [scores("left", 8.0, bias=-3.0, error_mm=40.0), scores("default+imus", 2.0, r=0.99)]
    return {t.caption.split(":")[0]: t for t in accuracy_tables(evaluation(*methods))}


def test_errors_stand_angle_by_angle_with_the_best_marked(tables):
    table = tables["Error"]
    assert table.columns == ["left", "default + IMUs"]
    assert texts(table, "left hip flexion") == ["20.0", "14.0*"]
    assert texts(table, "right knee flexion") == ["8.0", "2.0*"]
    # One of twelve angles, and one of six, is 12° worse than the rest.
    assert texts(table, "mean of all") == ["9.0", "3.0*"]
    assert texts(table, "mean of hips and knees") == ["10.0", "4.0*"]


def test_the_best_correlation_is_the_largest_and_an_unknown_one_a_dash(tables):
    table = tables["Correlation with the reference"]
    assert texts(table, "left hip flexion") == ["–", "–"]
    assert texts(table, "left knee flexion") == ["0.900", "0.990*"]


def test_bias_has_its_sign_and_the_best_is_nearest_to_zero(tables):
    assert texts(tables["Bias"], "left knee flexion") == ["−3.0", "0.0*"]
    assert texts(tables["Bias"], "mean size") == ["3.0", "0.0*"]


def test_limits_of_agreement_are_bias_and_spread(tables):
    # RMSE 8, bias −3: SD² = (64 − 9) · 101/100, SD = 7.453, limits −3 ∓ 14.6.
    limits = tables["Limits of agreement (Bland and Altman)"]
    assert texts(limits, "left knee flexion")[0] == "−18 … +12"


def test_joint_errors_end_in_their_mean(tables):
    assert texts(tables["Joint position error [mm]"], "mean (MPJPE)") == ["40", "20*"]


def test_a_reference_of_angles_has_no_joint_errors():
    alone = scores("left", 8.0, error_mm=np.nan)
    captions = [table.caption for table in accuracy_tables(evaluation(alone))]
    assert not any("Joint position" in caption for caption in captions)


def test_a_method_alone_is_not_the_best_of_anything():
    table = overview_table(evaluation(scores("left", 8.0)))
    assert not any(cell.is_best for row in table.rows for cell in row.cells)


def test_the_overview_has_the_lag_in_milliseconds():
    table = overview_table(evaluation(scores("left", 8.0), scores("right", 9.0)))
    assert texts(table, "lag [ms]") == ["+50*", "+50*"]


def test_coverage_has_the_shares_of_a_consistent_method():
    coverage = {
        "li2020": {
            "left_knee_flexion": Coverage(
                within_1=0.5, within_2=0.9, mean_stddev_deg=3.0, samples=100
            ),
            "left_hip_flexion": Coverage(
                within_1=0.8, within_2=1.0, mean_stddev_deg=6.0, samples=200
            ),
        }
    }
    table = coverage_table(coverage)
    assert texts(table, "li2020") == ["70.0", "96.7", "5.0", "300"]
    assert texts(table, "if consistent")[:2] == ["68.3", "95.5"]


def test_without_any_uncertainty_there_is_no_table_of_it():
    assert coverage_table({"mean": {}}) is None


def ranges(**highest):
    return {
        name: AngleRange(
            lowest_deg=-10.0, lowest_s=1.0, highest_deg=highest.get(name, 20.0), highest_s=2.5
        )
        for name in ANGLES
    }


def test_peaks_are_timed():
    table = peak_table("fused", ranges(left_knee_flexion=95.0))
    assert texts(table, "left knee flexion") == ["−10.0", "1.0", "95.0", "2.5", "105.0"]


def test_left_and_right_are_compared_by_range_and_by_peak():
    table = symmetry_table("fused", ranges(left_knee_flexion=60.0, right_knee_flexion=40.0))
    # Ranges 70 and 50: 20 / 60. Peaks 60 and 40: 20 / 50.
    assert texts(table, "knee flexion") == ["70.0", "50.0", "+33", "60.0", "40.0", "+40"]


def account():
    """Four instants of two degrees of freedom."""
    source = np.array([[1, 0], [1, 3], [3, 3], [3, 2]], np.uint8)
    zero = np.zeros((4, 2))
    return EstimateSeries(
        stamps_ns=np.arange(4) * 10**9,
        names=("left_knee_flexion", "left_hip_flexion"),
        position=zero,
        position_stddev=zero,
        weight_kinect=zero,
        weight_imu=zero,
        source=source,
        latency_s=np.array([0.010, 0.012, 0.014, 0.030]),
    )


def test_sources_are_shares_of_the_instants():
    table = source_table("fused", account())
    assert table.columns == ("Kinect", "Kinect and IMU", "IMU", "predicted")
    assert texts(table, "left knee flexion") == ["50", "50", "0", "0"]
    assert texts(table, "left hip flexion") == ["0", "50", "25", "25"]
    assert texts(table, "all") == ["25.0", "50.0", "12.5", "12.5"]


def test_latency_is_in_milliseconds():
    assert texts(timing_table({"fused": account()}), "fused") == ["13", "30", "30"]


def test_numbers_have_a_true_minus_and_no_signed_zero():
    assert number(-1.25, 1) == "−1.2"
    assert number(-0.01, 1) == "0.0"
    assert number(0.04, 1, sign=True) == "0.0"
    assert number(np.nan, 1) == "–"


@pytest.mark.parametrize(
    ("judge", "best"),
    [(min, 0), (max, 2), (nearest_zero, 1)],
    ids=["smallest", "largest", "nearest_zero"],
)
def test_the_best_value_is_selected_by_the_given_function(judge, best):
    row = number_row("x", [-5.0, 1.0, 3.0, np.nan], 1, judge)
    assert [cell.is_best for cell in row.cells] == [index == best for index in range(4)]


def test_equal_as_shown_are_equally_good():
    row = number_row("x", [1.01, 1.04, 2.0], 1, min)
    assert [cell.is_best for cell in row.cells] == [True, True, False]
