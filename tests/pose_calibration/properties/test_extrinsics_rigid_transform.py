"""Properties of every rigid fit."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pose_calibration.geometry.rigid_transform import (
    CalibrationError,
    estimate_rigid_transform,
    estimate_rigid_transform_robustly,
    spread,
)
from pose_core.transforms import inverse, transformed

SEEDS = range(20)


def random_transform(rng):
    T = np.eye(4)
    T[:3, :3] = Rotation.random(random_state=int(rng.integers(2**31))).as_matrix()
    T[:3, 3] = rng.uniform(-3.0, 3.0, 3)
    return T


def cloud(rng, count=60):
    return rng.normal(0.0, [0.5, 0.3, 0.2], (count, 3)) + [0.0, 0.0, 2.5]


@pytest.mark.parametrize("seed", SEEDS)
def test_exact_points_give_the_exact_transform(seed):
    rng = np.random.default_rng(seed)
    T, source = random_transform(rng), cloud(rng)
    estimate = estimate_rigid_transform(source, transformed(T, source))
    np.testing.assert_allclose(estimate, T, atol=1e-9)


@pytest.mark.parametrize("seed", SEEDS)
def test_the_rotation_is_proper_whatever_the_points(seed):
    rng = np.random.default_rng(seed)
    source, target = cloud(rng), cloud(rng)
    target[:, 0] *= -1.0  # a mirror image tempts to a reflection
    for T in (
        estimate_rigid_transform(source, target),
        estimate_rigid_transform_robustly(source, target).T_target_source,
    ):
        np.testing.assert_allclose(T[:3, :3] @ T[:3, :3].T, np.eye(3), atol=1e-9)
        assert np.linalg.det(T[:3, :3]) == pytest.approx(1.0)
        np.testing.assert_array_equal(T[3], [0.0, 0.0, 0.0, 1.0])


@pytest.mark.parametrize("seed", SEEDS)
def test_exchanging_the_clouds_inverts_the_transform(seed):
    rng = np.random.default_rng(seed)
    source = cloud(rng)
    target = transformed(random_transform(rng), source) + rng.normal(0.0, 0.01, source.shape)
    forth = estimate_rigid_transform(source, target)
    back = estimate_rigid_transform(target, source)
    np.testing.assert_allclose(back, inverse(forth), atol=1e-9)


@pytest.mark.parametrize("seed", SEEDS)
def test_moving_the_target_moves_the_transform(seed):
    rng = np.random.default_rng(seed)
    source = cloud(rng)
    target = transformed(random_transform(rng), source) + rng.normal(0.0, 0.01, source.shape)
    moved = random_transform(rng)
    plain = estimate_rigid_transform(source, target)
    after = estimate_rigid_transform(source, transformed(moved, target))
    np.testing.assert_allclose(after, moved @ plain, atol=1e-8)


@pytest.mark.parametrize("seed", SEEDS)
def test_least_squares_beats_every_nearby_transform(seed):
    rng = np.random.default_rng(seed)
    source = cloud(rng)
    weights = rng.uniform(0.1, 1.0, len(source))
    target = transformed(random_transform(rng), source) + rng.normal(0.0, 0.02, source.shape)
    T = estimate_rigid_transform(source, target, weights)
    best = np.linalg.norm(target - transformed(T, source), axis=1)
    rms = np.sqrt(np.average(best**2, weights=weights))
    for _ in range(20):
        nudge = np.eye(4)
        nudge[:3, :3] = Rotation.from_rotvec(rng.normal(0.0, 0.01, 3)).as_matrix()
        nudge[:3, 3] = rng.normal(0.0, 0.01, 3)
        residuals = np.linalg.norm(target - transformed(nudge @ T, source), axis=1)
        assert np.sqrt(np.average(residuals**2, weights=weights)) >= rms


@pytest.mark.parametrize("share", [0.1, 0.3])
@pytest.mark.parametrize("seed", SEEDS)
def test_outliers_do_not_move_the_robust_fit(seed, share):
    rng = np.random.default_rng(seed)
    T, source = random_transform(rng), cloud(rng, 300)
    target = transformed(T, source) + rng.normal(0.0, 0.005, source.shape)
    wrong = rng.random(len(source)) < share
    target[wrong] += rng.uniform(0.3, 1.5, 3)  # all to the same side: the mean follows
    fit = estimate_rigid_transform_robustly(source, target)
    error = transformed(fit.T_target_source, source) - transformed(T, source)
    assert np.linalg.norm(error, axis=1).max() < 0.006
    assert (fit.weights[wrong] == 0.0).all()
    assert np.median(fit.residuals[~wrong]) == pytest.approx(0.0077, rel=0.1)


def test_the_robust_fit_is_the_same_every_time():
    rng = np.random.default_rng(1)
    source, target = cloud(rng), cloud(rng)
    first = estimate_rigid_transform_robustly(source, target)
    second = estimate_rigid_transform_robustly(source, target)
    assert first.T_target_source.tobytes() == second.T_target_source.tobytes()


def test_points_of_weight_zero_do_not_count():
    rng = np.random.default_rng(2)
    T, source = random_transform(rng), cloud(rng)
    target = transformed(T, source)
    target[:20] = 1e3
    weights = np.ones(len(source))
    weights[:20] = 0.0
    np.testing.assert_allclose(estimate_rigid_transform(source, target, weights), T, atol=1e-9)


def test_two_points_are_refused():
    with pytest.raises(CalibrationError, match="found 2 matched points, expected 3"):
        estimate_rigid_transform(np.eye(3)[:2], np.eye(3)[:2])


@pytest.mark.parametrize(
    "fit", [estimate_rigid_transform, estimate_rigid_transform_robustly], ids=["plain", "robust"]
)
def test_points_on_a_line_are_refused_with_their_spread(fit):
    rng = np.random.default_rng(3)
    line = np.outer(rng.uniform(-0.5, 0.5, 50), [0.0, 1.0, 0.0]) + rng.normal(0.0, 0.002, (50, 3))
    with pytest.raises(CalibrationError, match=r"nearly collinear \(spread 0\.\d+, 0\.00\d"):
        fit(line, line)


def test_the_spread_is_the_deviation_along_the_principal_axes():
    rng = np.random.default_rng(4)
    points = transformed(random_transform(rng), rng.normal(0.0, [0.5, 0.2, 0.1], (100_000, 3)))
    np.testing.assert_allclose(spread(points), [0.5, 0.2, 0.1], rtol=0.02)
