"""Commands are within all limits for any targets."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from pose_teleop.motion_limiter import MotionLimiter, MotionLimits

pytest.importorskip("ruckig")
PERIOD_S = 0.01
LIMITS = MotionLimits(
    lower=np.array([-1.0, -0.2, -3.0]),
    upper=np.array([1.0, 2.0, 0.5]),
    velocity=np.array([2.0, 8.0, 0.5]),
    acceleration=np.array([10.0, 60.0, 3.0]),
    jerk=np.array([250.0, 1500.0, 75.0]),
)


def excess(motions, limits):
    """How far motions go beyond limits, over the limits; jerk between one and the next."""
    position, velocity, acceleration = (
        np.array([getattr(m, name) for m in motions])
        for name in ("position", "velocity", "acceleration")
    )
    jerk = np.diff(acceleration, axis=0) / PERIOD_S
    return {
        "position": np.maximum(position - limits.upper, limits.lower - position).max(),
        "velocity": (np.abs(velocity) / limits.velocity).max() - 1.0,
        "acceleration": (np.abs(acceleration) / limits.acceleration).max() - 1.0,
        "jerk": (np.abs(jerk) / limits.jerk).max() - 1.0,
    }


def jumping(limiter, seed, steps):
    rng = np.random.default_rng(seed)
    target = np.zeros(3)
    motions = [limiter.motion]
    for _ in range(steps):
        if rng.random() < 0.1:
            target = rng.uniform(-4.0, 4.0, 3)
        if rng.random() < 0.02:
            target = np.where(rng.random(3) < 0.5, np.nan, target)
        rate = rng.normal(0.0, 5.0, 3)
        fastest = np.inf if rng.random() < 0.5 else 100.0
        moved = limiter.brake(PERIOD_S) if rng.random() < 0.03 else None
        motions.append(moved or limiter.follow(target, rate, PERIOD_S, fastest))
    return motions


@settings(max_examples=15, deadline=None, derandomize=True)
@given(st.integers(0, 10_000))
def test_no_limit_is_exceeded_by_targets_that_jump_and_are_not_numbers(seed):
    limiter = MotionLimiter(LIMITS)

    found = excess(jumping(limiter, seed, 300), LIMITS)

    assert max(found.values()) < 1e-9, found


@settings(max_examples=15, deadline=None, derandomize=True)
@given(st.integers(0, 10_000))
def test_the_way_to_a_stop_is_within_all_limits_too_and_ends_at_rest(seed):
    limiter = MotionLimiter(LIMITS)
    motions = jumping(limiter, seed, 40)

    way = limiter.way_to_stop(PERIOD_S)

    assert max(excess([motions[-1], *way], LIMITS).values()) < 1e-9
    assert not way or way[-1].is_at_rest


def test_a_reachable_target_is_reached_and_kept():
    limiter = MotionLimiter(LIMITS)
    for _ in range(400):
        motion = limiter.follow(np.array([0.7, 1.5, -0.4]), np.zeros(3), PERIOD_S)

    np.testing.assert_allclose(motion.position, [0.7, 1.5, -0.4], atol=1e-9)
    assert motion.is_at_rest


def test_a_target_beyond_a_limit_is_followed_to_the_limit():
    limiter = MotionLimiter(LIMITS)
    for _ in range(1200):
        motion = limiter.follow(np.array([5.0, -5.0, -5.0]), np.full(3, 9.0), PERIOD_S)

    np.testing.assert_allclose(motion.position, [1.0, -0.2, -3.0], atol=1e-5)


def test_a_target_that_is_not_a_number_makes_it_brake_and_is_counted():
    limiter = MotionLimiter(LIMITS)
    for _ in range(20):
        limiter.follow(np.full(3, 0.4), np.zeros(3), PERIOD_S)
    for _ in range(60):
        motion = limiter.follow(np.full(3, np.nan), np.zeros(3), PERIOD_S)

    assert motion.is_at_rest
    assert limiter.counters["targets_not_finite"] == 60
