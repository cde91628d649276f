import numpy as np
import pytest

from pose_core.joints import JOINT_INDEX
from pose_core.streams.series import SkeletonSeries
from pose_evaluation.stability import (
    bone_length_cv_percent,
    bone_length_sd_mm,
    bone_lengths,
    rms_jerk,
)


def series(positions, rate=30.0):
    return SkeletonSeries(
        stamps_ns=np.round(np.arange(len(positions)) / rate * 1e9).astype(np.int64),
        positions=positions,
        tracking_state=np.full((len(positions), 15), 2, np.uint8),
    )


def thigh_of(lengths):
    """All joints at the origin, except for a left thigh of the given lengths."""
    positions = np.zeros((len(lengths), 15, 3))
    positions[:, JOINT_INDEX["left_knee"], 2] = -np.asarray(lengths)
    return positions


def test_a_bone_is_as_long_as_its_joints_are_apart():
    assert bone_lengths(thigh_of([0.4, 0.5]))["left_thigh"] == pytest.approx([0.4, 0.5])


def test_a_rigid_bone_does_not_vary():
    assert bone_length_sd_mm(thigh_of([0.4] * 5))["left_thigh"] == pytest.approx(0.0, abs=1e-9)


def test_a_bone_s_variation_is_its_standard_deviation():
    positions = thigh_of([0.39, 0.41] * 10)
    assert bone_length_sd_mm(positions)["left_thigh"] == pytest.approx(10.0)
    assert bone_length_cv_percent(positions)["left_thigh"] == pytest.approx(2.5)


def test_unknown_joints_are_left_out_of_a_bone():
    positions = thigh_of([0.39, 0.41, 9.0])
    positions[2, JOINT_INDEX["left_knee"]] = np.nan
    assert bone_length_sd_mm(positions)["left_thigh"] == pytest.approx(10.0)


def test_a_bone_never_seen_is_unknown():
    positions = thigh_of([0.4] * 3)
    positions[:, JOINT_INDEX["head"]] = np.nan
    assert np.isnan(bone_length_sd_mm(positions)["neck"])


def test_constant_acceleration_has_no_jerk():
    times = np.arange(60) / 30.0
    positions = np.zeros((60, 15, 3))
    positions[:, :, 0] = (2.0 * times**2)[:, None]
    assert rms_jerk(series(positions))["head"] == pytest.approx(0.0, abs=0.01)


def test_a_cubic_has_the_jerk_of_its_third_derivative():
    times = np.arange(60) / 30.0
    positions = np.zeros((60, 15, 3))
    positions[:, :, 1] = (times**3)[:, None]
    assert rms_jerk(series(positions))["left_foot"] == pytest.approx(6.0, rel=1e-3)


def test_jerk_skips_unknown_instants():
    times = np.arange(60) / 30.0
    positions = np.zeros((60, 15, 3))
    positions[:, :, 1] = (times**3)[:, None]
    positions[30] = np.nan
    assert rms_jerk(series(positions))["left_foot"] == pytest.approx(6.0, rel=1e-3)


def test_a_few_samples_have_no_jerk():
    assert np.isnan(rms_jerk(series(np.zeros((3, 15, 3))))["head"])
