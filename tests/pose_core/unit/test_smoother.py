"""The smoother agrees with least squares over all steps, and stops at a bounded prediction."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import block_diag

from pose_core.filter.layout import make_layout
from pose_core.filter.motion import MAX_STDDEV
from pose_core.filter.smoother import FilterStep, difference, smoothed, transition
from pose_core.filter.state import inject_error, start_state
from pose_core.filter.tuning import FilterTuning

LINKS, SLIDES = 3, 1
LAYOUT, TUNING = make_layout(LINKS, SLIDES), FilterTuning()


def state_at(x, rotation_stddev=0.15):
    tuning = replace(TUNING, start=replace(TUNING.start, rotation=rotation_stddev))
    rotations = np.tile(np.eye(3), (LINKS, 1, 1))
    return start_state(LAYOUT, 2, tuning, np.full(SLIDES, 1e-4), np.array([x, 0.0, 1.0]), rotations)


@pytest.mark.parametrize(
    ("stddev", "is_smoothed"), [(0.5, True), (MAX_STDDEV, False)], ids=["free", "at the bound"]
)
def test_a_bounded_prediction_ends_the_smoothing(stddev, is_smoothed):
    steps = [
        FilterStep(dt_s=0.0, predicted=None, updated=state_at(0.0)),
        FilterStep(dt_s=0.03, predicted=state_at(0.0, stddev), updated=state_at(0.1)),
    ]

    first, last = smoothed(steps, LAYOUT, TUNING.motion)

    assert last.pose.position[0] == pytest.approx(0.1)
    assert (first.pose.position[0] > 0.01) == is_smoothed


def random_covariance(rng, size, stddev):
    root = rng.normal(size=(size, size))
    return stddev**2 * (root @ root.T / size + 0.1 * np.eye(size))


def test_smoothed_states_are_those_of_least_squares_over_all_steps():
    """Errors of 1e-5, for which rotations are linear; without slides, which are not smoothed."""
    rng = np.random.default_rng(6)
    layout, count, scale = make_layout(LINKS, 0), 5, 1e-5
    size, dt_s = layout.body_size, (0.0, *rng.uniform(0.01, 0.05, count - 1))
    origin = start_state(
        layout, 2, TUNING, np.empty(0), np.zeros(3), np.tile(np.eye(3), (LINKS, 1, 1))
    )
    H = [rng.normal(size=(4, size)) for _ in range(count)]
    F = [transition(layout, TUNING.motion, each) for each in dt_s]
    P0, R = random_covariance(rng, size, scale), random_covariance(rng, 4, scale)
    Q = [random_covariance(rng, size, 0.3 * scale) for _ in range(count)]
    z = scale * rng.normal(size=(count, 4))

    def as_state(x, P):
        state = origin.copy()
        inject_error(state, x)
        return state._replace(P=P)

    steps, x, P = [], np.zeros(size), P0
    for step in range(count):
        if step > 0:
            x, P = F[step] @ x, F[step] @ P @ F[step].T + Q[step]
        predicted = as_state(x, P)
        K = P @ H[step].T @ np.linalg.inv(H[step] @ P @ H[step].T + R)
        x, P = x + K @ (z[step] - H[step] @ x), P - K @ H[step] @ P
        steps.append(FilterStep(dt_s=dt_s[step], predicted=predicted, updated=as_state(x, P)))

    motion = np.eye(count * size)  # rows: the first state, and each change that F does not explain
    for step in range(1, count):
        rows = slice(step * size, (step + 1) * size)
        motion[rows, (step - 1) * size : step * size] = -F[step]
    weight = np.linalg.inv(block_diag(P0, *Q[1:]))
    measured = block_diag(*H)
    precision = np.kron(np.eye(count), np.linalg.inv(R))
    covariance = np.linalg.inv(motion.T @ weight @ motion + measured.T @ precision @ measured)
    expected = (covariance @ measured.T @ precision @ z.ravel()).reshape(count, size)

    for step, state in enumerate(smoothed(steps, layout, TUNING.motion)):
        own = slice(step * size, (step + 1) * size)
        np.testing.assert_allclose(difference(state, origin), expected[step], atol=1e-4 * scale)
        np.testing.assert_allclose(state.P, covariance[own, own], atol=1e-6 * scale**2)
