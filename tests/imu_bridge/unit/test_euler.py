"""Roll, pitch, yaw, zhang2015 (3)."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from imu_bridge.filters.euler import roll_pitch_yaw


def rotation(angles: np.ndarray) -> Rotation:
    return Rotation.from_euler("ZYX", np.asarray(angles)[..., ::-1])


def error(q: np.ndarray, angles: np.ndarray) -> float:
    return float(np.max((rotation(angles) * Rotation.from_quat(q).inv()).magnitude()))


def test_angles_are_those_of_scipy():
    q = Rotation.random(500, random_state=3)
    np.testing.assert_allclose(
        roll_pitch_yaw(q.as_quat()), q.as_euler("ZYX")[:, ::-1], atol=1e-9, rtol=0
    )


def test_shape_of_the_input_is_kept():
    q = Rotation.random(6, random_state=3).as_quat()
    np.testing.assert_array_equal(
        roll_pitch_yaw(q.reshape(2, 3, 4)), roll_pitch_yaw(q).reshape(2, 3, 3)
    )
    np.testing.assert_array_equal(roll_pitch_yaw(q[0]), roll_pitch_yaw(q)[0])


def test_sign_of_the_quaternion_is_irrelevant():
    q = Rotation.random(50, random_state=4).as_quat()
    np.testing.assert_allclose(roll_pitch_yaw(-q), roll_pitch_yaw(q))


@pytest.mark.parametrize("pitch", [np.pi / 2, -np.pi / 2])
@pytest.mark.parametrize("roll", [-3.0, -1.2, 0.0, 0.4, 2.9])
@pytest.mark.parametrize("yaw", [-2.0, 0.0, 3.1])
def test_at_a_pole_roll_is_zero_and_the_rotation_is_kept(pitch: float, roll: float, yaw: float):
    q = rotation(np.array([roll, pitch, yaw])).as_quat()
    angles = roll_pitch_yaw(q)
    assert angles[0] == 0.0
    assert angles[1] == pitch
    assert error(q, angles) < 1e-7


@pytest.mark.parametrize("pitch", [np.pi / 2, -np.pi / 2])
def test_at_a_pole_a_given_roll_is_kept(pitch: float):
    q = rotation(np.array([0.7, pitch, -0.4])).as_quat()
    np.testing.assert_allclose(roll_pitch_yaw(q, roll_at_pole=0.7), [0.7, pitch, -0.4], atol=1e-7)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_with_the_last_roll_angles_are_continuous_into_the_pole(sign: float):
    distances = np.array([1e-2, 1e-4, 1e-6, 1e-8, 0.0])
    roll = 0.0
    for distance in distances:
        q = rotation(np.array([0.3, sign * (np.pi / 2 - distance), 1.1])).as_quat()
        roll, pitch, yaw = roll_pitch_yaw(q, roll_at_pole=roll)
        assert roll == pytest.approx(0.3, abs=1e-6)
        assert yaw == pytest.approx(1.1, abs=1e-6)
        assert pitch == pytest.approx(sign * (np.pi / 2 - distance), abs=1e-7)


def test_rotation_is_kept_at_every_distance_from_the_poles():
    rng = np.random.default_rng(5)
    distance = np.concatenate([[0.0], np.logspace(-12, 0, 200)])
    angles = rng.uniform(-np.pi, np.pi, (len(distance), 3))
    angles[:, 1] = np.where(rng.random(len(distance)) < 0.5, 1, -1) * (np.pi / 2 - distance)
    q = rotation(angles).as_quat()
    assert error(q, roll_pitch_yaw(q)) < 2e-7


def test_half_turns_lie_within_the_range():
    angles = roll_pitch_yaw([[1.0, 0, 0, 0], [0, 1.0, 0, 0], [0, 0, 1.0, 0]])
    assert np.all(np.abs(angles) <= np.pi)
    assert error(np.eye(4)[:3], angles) < 1e-12
