"""Madgwick's filter, zhang2015 (1), (2)."""

import numpy as np
import pytest
from madgwick_filter import advance, make_filter
from scipy.spatial.transform import Rotation

from imu_bridge.filters.madgwick import MadgwickOrientation, initial_orientation

GRAVITY = np.array([0.0, 0.0, 9.81])
FIELD = np.array([0.0, 20e-6, -43e-6])  # [T] dips by 65 degrees
NAN = np.full(3, np.nan)
ORIENTATIONS = Rotation.concatenate(
    [
        Rotation.identity(),
        Rotation.from_euler("xyz", [[90, 0, 0], [-90, 0, 0], [180, 0, 0]], degrees=True),
        Rotation.from_euler("xyz", [[0, 90, 0], [0, -90, 0], [0, 180, 0]], degrees=True),
        Rotation.from_euler("xyz", [[0, 0, 90], [0, 0, -90], [0, 0, 180]], degrees=True),
        Rotation.random(40, random_state=11),
    ]
)
COUNT = len(ORIENTATIONS)
ALL = np.arange(COUNT)


def error_deg(q: np.ndarray, truth: Rotation) -> np.ndarray:
    return np.degrees((truth.inv() * Rotation.from_quat(q)).magnitude())


def inclination_error_deg(q: np.ndarray, truth: Rotation) -> np.ndarray:
    up = truth.apply(Rotation.from_quat(q).inv().apply([0, 0, 1]))
    return np.degrees(np.arctan2(np.hypot(up[:, 0], up[:, 1]), up[:, 2]))


def run(
    filter_: MadgwickOrientation, steps: int, dt: float, rate, acceleration, field
) -> np.ndarray:
    n = len(filter_.orientation)
    arrays = [np.broadcast_to(a, (n, 3)) for a in (rate, acceleration, field)]
    for _ in range(steps):
        q = advance(filter_, np.arange(n), np.full(n, dt), *arrays)
    return q


def started(q: np.ndarray, beta: float) -> MadgwickOrientation:
    filter_ = make_filter(len(q), beta)
    filter_.orientation[:] = q
    filter_.has_heading[:] = True
    return filter_


def test_first_sample_gives_the_orientation_at_every_tilt():
    q = run(
        make_filter(COUNT, 0.1),
        1,
        0.0,
        np.zeros(3),
        ORIENTATIONS.inv().apply(GRAVITY),
        ORIENTATIONS.inv().apply(FIELD),
    )
    assert error_deg(q, ORIENTATIONS).max() < 1e-4


def test_first_sample_without_a_field_gives_the_inclination_at_every_tilt():
    filter_ = make_filter(COUNT, 0.1)
    q = run(filter_, 1, 0.0, np.zeros(3), ORIENTATIONS.inv().apply(GRAVITY), NAN)
    assert inclination_error_deg(q, ORIENTATIONS).max() < 1e-4
    assert not filter_.has_heading.any()


def test_a_sensor_at_rest_converges_to_the_truth_from_any_start():
    start = Rotation.random(COUNT, random_state=12)
    q = run(
        started(start.as_quat(), 1.0),
        800,
        0.01,
        np.zeros(3),
        ORIENTATIONS.inv().apply(GRAVITY),
        ORIENTATIONS.inv().apply(FIELD),
    )
    assert error_deg(q, ORIENTATIONS).max() < 1e-3


def test_without_a_field_the_inclination_converges_and_the_heading_stays():
    truth = Rotation.from_euler("x", 40, degrees=True)
    start = Rotation.from_euler("x", 10, degrees=True)
    q = run(
        started(start.as_quat()[None], 1.0), 400, 0.01, np.zeros(3), truth.inv().apply(GRAVITY), NAN
    )
    assert error_deg(q, truth).max() < 1e-3


def test_a_correction_never_turns_faster_than_twice_beta():
    start = Rotation.from_euler("z", 90, degrees=True)
    q = run(started(start.as_quat()[None], 0.1), 1, 0.01, np.zeros(3), GRAVITY, FIELD)
    assert np.radians(error_deg(q, start)) == pytest.approx(2 * 0.1 * 0.01, rel=1e-6)


def test_a_turned_field_leaves_the_inclination_alone():
    turned = Rotation.from_euler("z", 50, degrees=True).apply([0.0, 30e-6, 10e-6])
    q = run(started(np.array([[0, 0, 0, 1.0]]), 0.5), 2000, 0.01, np.zeros(3), GRAVITY, turned)
    assert inclination_error_deg(q, Rotation.identity()).max() < 1e-3
    assert error_deg(q, Rotation.from_euler("z", -50, degrees=True)).max() < 1e-3


def test_the_first_field_after_a_start_without_one_turns_the_heading_at_once():
    truth = Rotation.from_euler("ZX", [120, 30], degrees=True)
    filter_ = make_filter(1, 0.1)
    run(filter_, 5, 0.01, np.zeros(3), truth.inv().apply(GRAVITY), NAN)
    q = run(filter_, 1, 0.01, np.zeros(3), truth.inv().apply(GRAVITY), truth.inv().apply(FIELD))
    assert error_deg(q, truth).max() < 1e-4
    assert filter_.has_heading.all()


@pytest.mark.parametrize("rate", [[0.3, 0, 0], [0, -4.0, 1.0], [20.0, 10.0, -15.0], [1e-9, 0, 0]])
def test_pure_rotation_is_integrated_exactly(rate: list[float]):
    q = run(started(ORIENTATIONS.as_quat(), 0.0), 100, 0.01, np.array(rate), GRAVITY, FIELD)
    truth = ORIENTATIONS * Rotation.from_rotvec(np.array(rate))
    assert np.radians(error_deg(q, truth)).max() < 1e-9


@pytest.mark.parametrize("useless", [np.zeros(3), NAN, np.array([0.0, np.nan, 9.81])])
def test_without_gravity_the_gyroscope_alone_integrates(useless: np.ndarray):
    q = run(
        started(np.array([[0, 0, 0, 1.0]]), 1.0), 50, 0.01, np.array([1.0, 0, 0]), useless, FIELD
    )
    assert error_deg(q, Rotation.from_rotvec([0.5, 0, 0])).max() < 1e-9


def test_before_the_first_gravity_there_is_no_orientation():
    filter_ = make_filter(2, 0.1)
    q = run(filter_, 3, 0.01, np.zeros(3), NAN, FIELD)
    assert np.isnan(q).all()
    q = run(filter_, 1, 0.01, np.zeros(3), GRAVITY, FIELD)
    assert error_deg(q, Rotation.identity()).max() < 1e-9


def test_a_field_along_gravity_gives_no_heading():
    filter_ = make_filter(1, 0.1)
    q = run(filter_, 10, 0.01, np.zeros(3), GRAVITY, np.array([0, 0, -40e-6]))
    assert not filter_.has_heading.any()
    assert inclination_error_deg(q, Rotation.identity()).max() < 1e-9


def test_near_the_identity_nothing_is_lost():
    small = Rotation.from_rotvec(np.random.default_rng(6).normal(0, 1e-9, (20, 3)))
    q = run(
        started(small.as_quat(), 0.5),
        1,
        0.01,
        np.full(3, 1e-9),
        small.inv().apply(GRAVITY),
        small.inv().apply(FIELD),
    )
    assert np.isfinite(q).all()
    assert np.radians(error_deg(q, small)).max() < 1e-10


def test_reset_begins_one_sensor_anew():
    filter_ = started(np.array([[0, 0, 0, 1.0], [0, 0, 0, 1.0]]), 0.1)
    filter_.reset(1)
    assert np.isnan(filter_.orientation[1]).all()
    assert filter_.has_heading.tolist() == [True, False]
    np.testing.assert_array_equal(filter_.orientation[0], [0, 0, 0, 1])


def test_initial_orientation_turns_gravity_up_and_the_field_north():
    up = ORIENTATIONS.inv().apply([0, 0, 1])
    north = ORIENTATIONS.inv().apply(FIELD / np.linalg.norm(FIELD))
    q = initial_orientation(up, north, np.ones(COUNT, dtype=bool))
    assert error_deg(q, ORIENTATIONS).max() < 1e-4


@pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-9, 1e-8, 1e-7, 1e-4])
def test_initial_orientation_is_exact_near_upside_down(angle: float):
    truth = Rotation.from_euler("yz", [np.pi - angle, 0.3])
    up, north = truth.inv().apply([[0, 0, 1], FIELD / np.linalg.norm(FIELD)])
    q = initial_orientation(up[None], north[None], np.array([True]))
    assert np.radians(error_deg(q, truth)).max() < 5e-8
