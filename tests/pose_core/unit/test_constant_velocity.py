import numpy as np
import pytest
from filterpy.kalman import KalmanFilter

from pose_core.baseline_filters.constant_velocity import ConstantVelocityFilter

DT = 0.03


def test_each_channel_equals_filterpys_kalman_filter():
    rng = np.random.default_rng(4)
    power, variance = np.array([3.0, 50.0]), 0.01
    ours = ConstantVelocityFilter(np.array([1.0, -2.0]), 0.2, 0.7, power)
    theirs = []
    for start, q in zip((1.0, -2.0), power, strict=True):
        each = KalmanFilter(dim_x=2, dim_z=1)
        each.x = np.array([[start], [0.0]])
        each.P = np.diag([0.04, 0.49])
        each.F = np.array([[1.0, DT], [0.0, 1.0]])
        each.H = np.array([[1.0, 0.0]])
        each.R *= variance
        each.Q = q * np.array([[DT**3 / 3, DT**2 / 2], [DT**2 / 2, DT]])
        theirs.append(each)
    for _ in range(20):
        z = rng.normal(size=2)
        ours.predict(DT)
        ours.update(z, np.full(2, variance))
        for each, value in zip(theirs, z, strict=True):
            each.predict()
            each.update(value)
    np.testing.assert_allclose(ours.mean, [each.x[:, 0] for each in theirs], rtol=1e-9)
    np.testing.assert_allclose(ours.covariance, [each.P for each in theirs], rtol=1e-7)


def test_a_missing_value_does_not_update_its_channel():
    filter_ = ConstantVelocityFilter(np.zeros(2), 0.1, 0.1, 1.0)
    before = filter_.covariance.copy()
    filter_.update(np.array([np.nan, 1.0]), np.full(2, 0.01))
    assert filter_.mean[0, 0] == 0.0
    assert filter_.mean[1, 0] == pytest.approx(0.5)
    np.testing.assert_array_equal(filter_.covariance[0], before[0])
