"""Properties of Madgwick's filter, and an independent implementation of the paper."""

import numpy as np
from madgwick_filter import advance, make_filter
from scipy.spatial.transform import Rotation

NODES = 7
STEPS = 60


def random_samples(seed: int) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(seed)
    samples = {
        "dt": rng.uniform(0.002, 0.03, (STEPS, NODES)),
        "rate": rng.normal(0, 2, (STEPS, NODES, 3)),
        "acceleration": rng.normal(0, 5, (STEPS, NODES, 3)) + np.array([0, 0, 9.8]),
        "field": rng.normal(0, 20e-6, (STEPS, NODES, 3)) + np.array([0, 20e-6, -40e-6]),
    }
    samples["acceleration"][rng.random((STEPS, NODES)) < 0.1] = np.nan
    samples["acceleration"][rng.random((STEPS, NODES)) < 0.05] = 0.0
    samples["field"][rng.random((STEPS, NODES)) < 0.5] = np.nan
    return samples


def run(samples: dict[str, np.ndarray], nodes: np.ndarray) -> np.ndarray:
    """Orientations of these nodes, in their order, all filtered together."""
    filter_ = make_filter(len(nodes), 0.3)
    index = np.arange(len(nodes))
    return np.array(
        [
            advance(filter_, index, *(samples[name][k][nodes] for name in samples))
            for k in range(STEPS)
        ]
    )


def test_all_nodes_at_once_equal_one_by_one():
    samples = random_samples(1)
    together = run(samples, np.arange(NODES))
    alone = np.concatenate([run(samples, np.array([i])) for i in range(NODES)], axis=1)
    np.testing.assert_allclose(together, alone, rtol=0, atol=1e-12)


def test_order_of_the_nodes_is_irrelevant():
    samples = random_samples(2)
    order = np.random.default_rng(0).permutation(NODES)
    np.testing.assert_allclose(
        run(samples, order), run(samples, np.arange(NODES))[:, order], rtol=0, atol=1e-12
    )


def test_a_node_that_has_no_sample_keeps_its_orientation():
    samples = random_samples(3)
    filter_ = make_filter(NODES, 0.3)
    for k in range(STEPS):
        present = np.flatnonzero(np.random.default_rng(k).random(NODES) < 0.5)
        before = filter_.orientation.copy()
        advance(filter_, present, *(samples[name][k][present] for name in samples))
        absent = np.setdiff1d(np.arange(NODES), present)
        np.testing.assert_array_equal(filter_.orientation[absent], before[absent])


def test_quaternions_stay_normalised():
    q = run(random_samples(4), np.arange(NODES))
    norm = np.linalg.norm(q[~np.isnan(q[..., 3])], axis=-1)
    np.testing.assert_allclose(norm, 1.0, atol=1e-12)


def test_scale_of_gravity_and_field_is_irrelevant():
    samples = random_samples(5)
    scaled = {**samples, "acceleration": samples["acceleration"] / 9.8}
    scaled["field"] = samples["field"] * 1e6
    np.testing.assert_allclose(
        run(scaled, np.arange(NODES)), run(samples, np.arange(NODES)), rtol=0, atol=1e-9
    )


def reference_step(
    q: np.ndarray,
    dt: float,
    rate: np.ndarray,
    acceleration: np.ndarray,
    field: np.ndarray,
    beta: float,
) -> np.ndarray:
    """zhang2015 (1), (2) written out for one sensor, with a numerical gradient."""
    up = acceleration / np.linalg.norm(acceleration)
    north = field / np.linalg.norm(field)
    h = Rotation.from_quat(q).apply(north)
    b = np.array([0.0, np.hypot(h[0], h[1]), h[2]])

    def half_square(p: np.ndarray) -> float:
        to_sensor = Rotation.from_quat(p).inv()
        gravity_part = to_sensor.apply([0.0, 0.0, 1.0]) - up
        field_part = to_sensor.apply(b) - north
        return 0.5 * float(gravity_part @ gravity_part + field_part @ field_part)

    epsilon = 1e-6
    gradient = np.array(
        [
            (half_square(q + epsilon * e) - half_square(q - epsilon * e)) / (2 * epsilon)
            for e in np.eye(4)
        ]
    )
    x, y, z, w = q
    wx, wy, wz = rate
    q_dot = 0.5 * np.array(  # zhang2015 (1), there as (w, x, y, z)
        [
            w * wx - z * wy + y * wz,
            z * wx + w * wy - x * wz,
            -(y * wx - x * wy - w * wz),
            -(x * wx + y * wy + z * wz),
        ]
    )
    q = q + (q_dot * dt - beta * dt * gradient / np.linalg.norm(gradient))  # zhang2015 (2)
    return q / np.linalg.norm(q)


def test_one_step_is_the_papers_to_second_order_in_time():
    rng = np.random.default_rng(7)
    dt, beta = 1e-4, 0.5
    for _ in range(50):
        q = Rotation.random(random_state=rng).as_quat()
        rate, acceleration, field = rng.normal(0, 1, (3, 3))
        filter_ = make_filter(1, beta)
        filter_.orientation[:] = q
        filter_.has_heading[:] = True
        ours = advance(
            filter_, np.array([0]), np.array([dt]), rate[None], acceleration[None], field[None]
        )[0]
        reference = reference_step(q, dt, rate, acceleration, field, beta)
        assert np.abs(ours - reference).max() < 10 * dt * dt
        assert np.abs(ours - q).max() > dt / 10
