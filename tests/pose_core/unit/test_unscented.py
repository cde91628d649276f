import numpy as np
import pytest
from filterpy.kalman import KalmanFilter, MerweScaledSigmaPoints, UnscentedKalmanFilter

from pose_core.baseline_filters.unscented import UnscentedTransform, kalman_update


def covariance(rng, size):
    A = rng.normal(size=(size, size))
    return A @ A.T + size * np.eye(size)


def update(transform, mean, P, z, h, R):
    points = transform.sigma_points(mean, P)
    state, measurement = transform.moments(points), transform.moments(h(points))
    return kalman_update(
        mean,
        P,
        transform.cross_covariance(state, measurement),
        z - measurement.mean,
        measurement.covariance + R,
    )


@pytest.mark.parametrize("alpha", [0.1, 0.5, 1.0])
def test_moments_of_a_linear_map_are_exact(alpha):
    rng = np.random.default_rng(1)
    mean, P, A = rng.normal(size=6), covariance(rng, 6), rng.normal(size=(4, 6))
    transform = UnscentedTransform(6, alpha=alpha)
    moments = transform.moments(transform.sigma_points(mean, P) @ A.T)
    np.testing.assert_allclose(moments.mean, A @ mean, atol=1e-9)
    np.testing.assert_allclose(moments.covariance, A @ P @ A.T, atol=1e-8)


def test_the_ukf_equals_the_kalman_filter_on_a_linear_model():
    rng = np.random.default_rng(2)
    mean, P, H = rng.normal(size=5), covariance(rng, 5), rng.normal(size=(3, 5))
    R, z = covariance(rng, 3), rng.normal(size=3)
    kalman = KalmanFilter(dim_x=5, dim_z=3)
    kalman.x, kalman.P, kalman.H, kalman.R = mean.copy(), P.copy(), H, R
    kalman.update(z)
    x, P_updated = update(UnscentedTransform(5), mean, P, z, lambda points: points @ H.T, R)
    np.testing.assert_allclose(x, kalman.x, atol=1e-9)
    np.testing.assert_allclose(P_updated, kalman.P, atol=1e-9)


def test_the_ukf_equals_filterpys_on_a_nonlinear_model():
    rng = np.random.default_rng(3)
    mean, P, R = rng.normal(size=4), 0.1 * covariance(rng, 4), covariance(rng, 2)
    z = rng.normal(size=2)

    def h(points):
        points = np.atleast_2d(points)
        return np.stack([np.sin(points[:, 0]) * points[:, 1], points[:, 2] ** 2], axis=1)

    points = MerweScaledSigmaPoints(4, 0.5, 2.0, 0.0)
    reference = UnscentedKalmanFilter(4, 2, 1.0, lambda x: h(x)[0], lambda x, dt: x, points)
    reference.x, reference.P, reference.R = mean.copy(), P.copy(), R
    reference.Q = np.zeros((4, 4))
    reference.predict()
    reference.update(z)
    x, P_updated = update(UnscentedTransform(4, alpha=0.5), mean, P, z, h, R)
    np.testing.assert_allclose(x, reference.x, atol=1e-10)
    np.testing.assert_allclose(P_updated, reference.P, atol=1e-10)


def test_updated_covariance_is_symmetric_and_positive():
    rng = np.random.default_rng(4)
    for _ in range(20):
        P, R = covariance(rng, 6), covariance(rng, 4)
        _, updated = update(
            UnscentedTransform(6),
            rng.normal(size=6),
            P,
            rng.normal(size=4),
            lambda points: np.tanh(points[:, :4]),
            R,
        )
        np.testing.assert_array_equal(updated, updated.T)
        assert np.linalg.eigvalsh(updated)[0] > 0.0
