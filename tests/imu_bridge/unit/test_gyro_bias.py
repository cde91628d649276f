"""Estimation of the gyroscopes' bias at rest."""

import numpy as np

from imu_bridge.filters.gyro_bias import RestBiasEstimator

BIAS = np.array([0.02, -0.03, 0.01])
GRAVITY = np.array([0.0, 0.0, 9.81])


def feed(estimator: RestBiasEstimator, seconds: float, rate, acceleration=GRAVITY, noise=0.005):
    rng = np.random.default_rng(8)
    for k in range(round(seconds * 100)):
        estimator.update(
            np.array([0]),
            np.array([0.01]),
            (rate(k * 0.01) if callable(rate) else rate) + rng.normal(0, noise, (1, 3)),
            (acceleration(k * 0.01) if callable(acceleration) else acceleration)
            + rng.normal(0, 0.03, (1, 3)),
        )


def test_a_rest_gives_the_bias():
    estimator = RestBiasEstimator(1, 2.0)
    feed(estimator, 2.1, BIAS)
    np.testing.assert_allclose(estimator.bias[0], BIAS, atol=0.001)
    assert estimator.rests.tolist() == [1]


def test_motion_gives_none():
    estimator = RestBiasEstimator(1, 2.0)
    feed(estimator, 6.0, lambda t: BIAS + [np.sin(5 * t), 0, 0])
    np.testing.assert_array_equal(estimator.bias, 0)


def test_a_fast_steady_turn_gives_none():
    estimator = RestBiasEstimator(1, 2.0)
    feed(estimator, 6.0, np.array([0, 0, 0.5]))
    np.testing.assert_array_equal(estimator.bias, 0)


def test_a_slow_steady_tilt_gives_none():
    rate = 0.05  # [rad/s]
    estimator = RestBiasEstimator(1, 2.0)
    feed(
        estimator,
        6.0,
        np.array([rate, 0, 0]),
        lambda t: 9.81 * np.array([0, np.sin(rate * t), np.cos(rate * t)]),
    )
    np.testing.assert_array_equal(estimator.bias, 0)


def test_later_rests_refine_the_bias():
    estimator = RestBiasEstimator(1, 1.0)
    feed(estimator, 1.0, BIAS)
    feed(estimator, 20.0, BIAS + 0.02)
    np.testing.assert_allclose(estimator.bias[0], BIAS + 0.02, atol=0.002)


def test_a_window_of_zero_estimates_nothing():
    estimator = RestBiasEstimator(1, 0.0)
    feed(estimator, 5.0, BIAS)
    np.testing.assert_array_equal(estimator.bias, 0)


def test_sensors_are_judged_each_by_itself():
    estimator = RestBiasEstimator(2, 1.0)
    for k in range(101):
        rates = np.array([BIAS, [3 * np.sin(k), 0, 0]])
        estimator.update(np.arange(2), np.full(2, 0.01), rates, np.tile(GRAVITY, (2, 1)))
    np.testing.assert_allclose(estimator.bias, [BIAS, [0, 0, 0]], atol=1e-9)
    assert estimator.rests.tolist() == [1, 0]
