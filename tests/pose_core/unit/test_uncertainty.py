import numpy as np
import pytest

from pose_core.body.model import load_body_model
from pose_core.estimators.uncertainty import FILTERED, coefficients_of
from pose_core.estimators.variance_scale import CONSISTENT_NIS, updated_mean_nis, variance_scale
from pose_core.kernels.output import published_variance
from pose_core.kernels.published_state import make_dof_estimate

MODEL = load_body_model("default")
KNEE, NECK = (MODEL.dof_names.index(name) for name in ("left_knee_flexion", "neck_flexion"))


def variance(distance, velocity=0.0, weight_imu=0.0, blended=0.0):
    size = MODEL.size
    out = np.empty(size)
    dof = make_dof_estimate(size)
    dof.variance[:], dof.blended[:] = 0.01, blended
    published_variance(
        dof,
        np.full(size, velocity),
        np.full(size, weight_imu),
        variance_scale(distance),
        coefficients_of(MODEL, FILTERED),
        out,
    )
    return out


def test_consistent_innovations_leave_the_variances_unchanged():
    assert variance(CONSISTENT_NIS)[NECK] == pytest.approx(0.01)


def test_what_blending_adds_is_not_calibrated():
    added = variance(CONSISTENT_NIS, blended=0.3) - variance(CONSISTENT_NIS)
    np.testing.assert_allclose(added, 0.3)


def test_large_innovations_enlarge_the_variances():
    mean_nis = CONSISTENT_NIS
    before = variance(mean_nis)
    for _ in range(300):
        mean_nis = updated_mean_nis(mean_nis, 1.0 / 30.0, 8.0)

    assert np.all(variance(mean_nis) > 1.5 * before)


def test_a_moving_joint_has_a_larger_variance_than_a_resting_one():
    still, quick = (variance(1.0, velocity)[KNEE] for velocity in (0.0, 2.0))

    assert quick > still


def test_missing_innovations_leave_the_scale_unchanged():
    assert updated_mean_nis(CONSISTENT_NIS, 1.0, np.nan) == CONSISTENT_NIS
