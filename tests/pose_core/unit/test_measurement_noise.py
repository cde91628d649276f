import numpy as np

from pose_core.baseline_filters.measurement_noise import (
    MAX_NOISE,
    fuse_measurements,
    measurement_noise,
)


def test_noise_is_the_square_of_the_inverse_density():
    z, u, variance = np.array([[1.03]]), np.array([1.0]), np.array([0.02**2])
    density = np.exp(-(0.03**2) / (2 * 0.02**2)) / (np.sqrt(2 * np.pi) * 0.02)
    np.testing.assert_allclose(measurement_noise(z, u, variance), [[density**-2]])


def test_noise_grows_with_the_distance_from_the_prediction():
    z = np.linspace(0.0, 0.5, 20)[:, None]
    noise = measurement_noise(z, np.zeros(1), np.array([0.05**2]))[:, 0]
    assert np.all(np.diff(noise) >= 0.0)
    assert np.all(np.isfinite(noise))


def test_a_far_outlier_has_no_weight_and_no_overflow():
    z, u = np.array([[0.01], [50.0]]), np.zeros(1)
    noise = measurement_noise(z, u, np.array([0.02**2]))
    fused, R = fuse_measurements(z, noise, u)
    np.testing.assert_allclose(fused, [0.01], atol=1e-3)
    assert np.isfinite(R[0])


def test_fusing_two_sensors_is_the_inverse_variance_mean():
    z, noise = np.array([[1.0], [2.0]]), np.array([[1.0], [3.0]])
    fused, R = fuse_measurements(z, noise, np.zeros(1))
    np.testing.assert_allclose(R, [0.75])
    np.testing.assert_allclose(fused, [1.25])


def test_order_of_the_sensors_is_irrelevant():
    rng = np.random.default_rng(5)
    z, noise = rng.normal(size=(4, 45)), rng.uniform(0.1, 2.0, (4, 45))
    order = [2, 0, 3, 1]
    one, other = fuse_measurements(z, noise, z[0]), fuse_measurements(z[order], noise[order], z[0])
    np.testing.assert_allclose(one, other, atol=1e-12)


def test_an_unmeasured_component_keeps_its_prediction_with_little_weight():
    z = np.array([[np.nan, 1.0], [np.nan, np.nan]])
    noise = measurement_noise(z, np.array([5.0, 1.0]), np.full(2, 0.01))
    fused, R = fuse_measurements(z, noise, np.array([5.0, 1.0]))
    np.testing.assert_allclose(fused, [5.0, 1.0])
    assert R[0] == MAX_NOISE**2
    assert R[1] < 1.0
