"""Headings of IMUs' worlds that joints tie together."""

import numpy as np
import pytest

from pose_core.imu.heading import HeadingAnchor
from pose_core.kernels import heading as kernel
from pose_core.kernels.anchors import STATES, Y, make_anchors, own_covariance
from pose_core.kernels.heading import relate

DEG = np.pi / 180.0


def two(headings=(10.0, 50.0), stddevs=(1.0, 8.0)):
    anchors = make_anchors(2)
    for row, (heading, stddev) in enumerate(zip(headings, stddevs, strict=True)):
        kernel.start(anchors, row, heading * DEG, stddev * DEG)
    return anchors


def related(anchors, turn_deg, times=1, stddev_deg=1.0, noise=1e-4):
    return [
        relate(anchors, 1, 0, turn_deg * DEG, (stddev_deg * DEG) ** 2, noise) for _ in range(times)
    ]


def test_a_joint_brings_an_uncertain_heading_to_its_neighbour_s():
    anchors = two()
    related(anchors, 30.0)
    heading = anchors.state[:, Y] / DEG
    assert heading[0] == pytest.approx(10.0, abs=0.5)
    assert 40.0 < heading[1] < 44.0
    assert np.sqrt(own_covariance(anchors, 1)[Y, Y]) < 5.0 * DEG


def test_a_joint_is_the_update_of_a_plain_kalman_filter():
    anchors = two()
    related(anchors, 38.0)
    x, P = anchors.state.ravel().copy(), anchors.covariance.copy()
    H = np.zeros(2 * STATES)
    H[kernel.Y], H[STATES + kernel.Y], H[STATES + kernel.BESIDE] = -1.0, 1.0, 1.0
    S = H @ P @ H + (2.0 * DEG) ** 2
    K = P @ H / S
    related(anchors, 41.0, stddev_deg=2.0)
    np.testing.assert_allclose(anchors.state.ravel(), x + K * (41.0 * DEG - H @ x), atol=1e-12)
    np.testing.assert_allclose(anchors.covariance, P - np.outer(K, K) * S, atol=1e-12)


def test_what_moves_a_heading_moves_the_neighbour_s_that_a_joint_ties_to_it():
    anchors = two(stddevs=(5.0, 5.0))
    related(anchors, 40.0, times=20)
    before = anchors.state[:, Y].copy()
    kernel.observe_standing(anchors, 0, 14.0 * DEG, 1.0 * DEG)
    moved = (anchors.state[:, Y] - before) / DEG
    assert moved[0] > 2.5
    assert moved[1] > 0.5 * moved[0]


def test_headings_that_no_joint_ties_stay_apart():
    anchors = two()
    before = anchors.state[1].copy(), own_covariance(anchors, 1).copy()
    for _ in range(10):
        kernel.predict(anchors, 0, 0.1)
        kernel.observe_standing(anchors, 0, 14.0 * DEG, 1.0 * DEG)
    np.testing.assert_array_equal(anchors.state[1], before[0])
    np.testing.assert_array_equal(own_covariance(anchors, 1), before[1])


def test_a_turn_that_contradicts_what_is_known_is_rejected():
    anchors = two(stddevs=(1.0, 1.0))
    before = anchors.state.copy()
    assert related(anchors, -140.0) == [False]
    np.testing.assert_array_equal(anchors.state, before)
    assert related(anchors, 41.0) == [True]


def test_a_world_that_has_turned_is_left_to_the_cameras_however_little_is_known():
    anchors = two(stddevs=(20.0, 20.0))
    assert related(anchors, 90.0) == [False]
    assert related(anchors, 60.0) == [True]


def test_what_is_not_known_learns_nothing():
    anchors = make_anchors(2)
    kernel.start(anchors, 0, 0.3, 0.1)
    before = anchors.covariance.copy()
    assert related(anchors, 40.0) == [True]
    assert np.isnan(anchors.state[1]).all()
    np.testing.assert_array_equal(anchors.covariance, before)


def test_a_lost_heading_leaves_no_trace_in_its_neighbour_s():
    anchors = two()
    related(anchors, 40.0, times=5)
    kernel.lose_heading(anchors, 1)
    kernel.observe_standing(anchors, 0, 12.0 * DEG, 1.0 * DEG)
    assert np.isnan(anchors.state[1]).all()
    assert np.isfinite(anchors.state[0]).all()
    assert not anchors.covariance[STATES:].any()


def test_a_noisy_joint_holds_its_neighbour_less():
    """Two minutes in which cameras see the one segment alone."""
    held = []
    for noise in (1e-3, 0.5):
        anchors = two(stddevs=(1.0, 3.0))
        for _ in range(30):
            for row in (0, 1):
                kernel.predict(anchors, row, 4.0)
            kernel.observe_standing(anchors, 0, 10.0 * DEG, 1.0 * DEG)
            related(anchors, 45.0, noise=noise)
        held.append(np.sqrt(own_covariance(anchors, 1)[Y, Y]))
    assert held[1] > 1.2 * held[0]


def test_the_covariance_stays_symmetric_and_positive():
    rng = np.random.default_rng(3)
    anchors = make_anchors(4)
    for row in range(4):
        kernel.start(anchors, row, 0.1 * row, 0.2)
    for _ in range(2000):
        row = int(rng.integers(4))
        kernel.predict(anchors, row, 0.05)
        if rng.uniform() < 0.5:
            kernel.observe_standing(anchors, row, 0.1 * row + 0.05 * rng.normal(), 0.05)
        elif row > 0:
            relate(anchors, row, row - 1, 0.1 + 0.02 * rng.normal(), 0.02**2, 0.01)
    np.testing.assert_allclose(anchors.covariance, anchors.covariance.T, atol=1e-15)
    assert np.linalg.eigvalsh(anchors.covariance).min() > -1e-12


def test_an_anchor_is_forgotten_with_what_it_had_to_do_with_others():
    anchors = two()
    related(anchors, 40.0, times=5)
    HeadingAnchor(anchors=anchors, row=1).reset()
    assert np.isnan(anchors.state[1]).all()
    assert not anchors.covariance[STATES:].any()
    assert not anchors.covariance[:, STATES:].any()
