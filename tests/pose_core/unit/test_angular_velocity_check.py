"""An IMU's angular velocity is held against the change of its own orientation."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from turning_imus import PERIOD_S, block, changed, turning

from pose_core.imu.angular_velocity_check import AngularVelocityCheck, RateFault
from pose_core.imu.imu_set import ImuSet

SECONDS = 6.0
OTHER_FRAME = Rotation.from_euler("xyz", [30.0, -40.0, 70.0], degrees=True)
FAULTS = {
    RateFault.ZERO: lambda rates: 0.0 * rates,
    RateFault.TOO_LARGE: np.degrees,
    RateFault.OTHER_AXES: lambda rates: rates * [1.0, 1.0, -1.0],
}


def rms(errors):
    return np.sqrt(np.mean(np.sum(np.square(errors), axis=1)))


@pytest.mark.parametrize("fault", FAULTS)
@pytest.mark.parametrize("speed", [1.0, 4.0, 15.0])
def test_a_wrong_angular_velocity_is_reported_and_replaced_by_the_orientation_difference(
    fault, speed
):
    orientations, rates = turning(SECONDS, speed=speed)
    check = AngularVelocityCheck()
    checked = check.checked(block(orientations, FAULTS[fault](rates)))
    assert check.faults == {"torso": fault}
    late = slice(300, None)
    assert rms(checked.angular_velocity[late] - rates[late]) < 0.05 * rms(rates[late])


def test_an_angular_velocity_in_degrees_per_second_is_replaced_from_the_first_turn_on():
    orientations, rates = turning(SECONDS, speed=4.0)
    checked = AngularVelocityCheck().checked(block(orientations, np.degrees(rates)))
    early = slice(30, 300)
    assert rms(checked.angular_velocity[early] - rates[early]) < 0.1 * rms(rates[early])


def test_an_angular_velocity_in_a_wrong_frame_is_replaced():
    orientations, rates = turning(SECONDS)
    check = AngularVelocityCheck()
    check.checked(block(orientations, OTHER_FRAME.apply(rates)))
    assert check.faults == {"torso": RateFault.OTHER_AXES}


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("speed", [0.0, 0.3, 1.0, 10.0])
def test_bias_noise_misalignment_and_lost_samples_pass_the_check(seed, speed):
    rng = np.random.default_rng(seed)
    orientations, rates = turning(20.0, seed=seed, speed=speed)
    noisy = orientations * Rotation.from_rotvec(0.01 * rng.standard_normal(rates.shape))
    misaligned = Rotation.from_rotvec(0.07 * rng.standard_normal(3)).apply(rates)
    measured = misaligned + [0.05, -0.05, 0.05] + 0.05 * rng.standard_normal(rates.shape)
    rows = np.flatnonzero(rng.random(len(rates)) > 0.2)
    check, given = AngularVelocityCheck(), block(noisy, measured).rows(rows)
    checked = check.checked(given)
    assert not check.faults
    assert np.array_equal(checked.angular_velocity, given.angular_velocity)


@pytest.mark.parametrize("repeated", [2, 5])
def test_orientations_of_a_lower_rate_than_the_gyroscope_pass_the_check(repeated):
    orientations, rates = turning(SECONDS)
    held = changed(
        orientations, slice(None), lambda some: some[np.arange(600) // repeated * repeated]
    )
    check = AngularVelocityCheck()
    check.checked(block(held, rates))
    assert not check.faults


def test_outlying_or_repeated_orientations_do_not_reject_the_angular_velocity():
    orientations, rates = turning(SECONDS)
    wild = changed(
        orientations, slice(200, 300), lambda some: Rotation.random(len(some), random_state=4)
    )
    stuck = changed(wild, slice(350, 450), lambda some: some[np.zeros(len(some), int)])
    check = AngularVelocityCheck()
    check.checked(block(stuck, rates))
    assert not check.faults


def test_a_missing_angular_velocity_is_replaced_by_the_orientation_difference():
    orientations, rates = turning(SECONDS)
    check = AngularVelocityCheck()
    checked = check.checked(block(orientations, np.full_like(rates, np.nan)))
    assert check.faults == {"torso": RateFault.MISSING}
    assert np.isfinite(checked.angular_velocity).all()
    assert rms(checked.angular_velocity[20:] - rates[20:]) < 0.05 * rms(rates)


def test_single_missing_angular_velocities_are_filled_in():
    orientations, rates = turning(SECONDS)
    measured = rates.copy()
    measured[100::50] = np.nan
    check = AngularVelocityCheck()
    checked = check.checked(block(orientations, measured))
    assert not check.faults
    assert rms(checked.angular_velocity - rates) < 0.02 * rms(rates)


def test_an_angular_velocity_is_used_again_once_it_passes_the_check():
    orientations, rates = turning(30.0)
    wrong = rates.copy()
    wrong[:600] = 0.0
    check, given = AngularVelocityCheck(), block(orientations, wrong)
    check.checked(given.rows(slice(0, 600)))
    assert check.faults
    check.checked(given.rows(slice(600, 3000)))
    assert not check.faults


def test_the_check_is_independent_of_the_block_size():
    orientations, rates = turning(2.0)
    given = block(orientations, np.degrees(rates))
    whole = AngularVelocityCheck().checked(given).angular_velocity
    check = AngularVelocityCheck()
    one_by_one = [check.checked(given.rows(slice(k, k + 1))).angular_velocity for k in range(200)]
    assert np.array_equal(whole, np.concatenate(one_by_one))


def test_a_sample_is_marked_if_its_rate_is_the_orientation_difference():
    orientations, rates = turning(SECONDS)
    imus = ImuSet()
    imus.add(block(orientations, np.zeros_like(rates)))
    given = block(orientations, rates)
    stamp_ns = int(given.stamps_ns[-1]) - round(1e9 * PERIOD_S)
    states = imus.read(stamp_ns)
    assert states.replaced_rates == {"torso"}
    assert states.segments == ("torso",)
    assert states.angular_velocity[0] == pytest.approx(rates[-2], abs=0.3)
    assert "zero while the orientation turns" in imus.contradicted_rates["torso"]


def test_an_angular_velocity_that_is_not_finite_any_more_is_named_until_it_is_measured_again():
    orientations, rates = turning(3 * SECONDS)
    third = len(rates) // 3
    check = AngularVelocityCheck()
    rates[third : 2 * third] = np.inf
    samples = block(orientations, rates)
    checked = check.checked(samples.rows(slice(0, 2 * third)))
    assert check.faults == {"torso": RateFault.LOST}
    assert np.isfinite(checked.angular_velocity).all()
    check.checked(samples.rows(slice(2 * third, 3 * third)))
    assert not check.faults


INVERSES = {
    "inverse": lambda orientations: orientations.inv(),
    "w x y z": lambda orientations: Rotation.from_quat(np.roll(orientations.as_quat(), 1, axis=1)),
}


@pytest.mark.parametrize("way", INVERSES)
@pytest.mark.parametrize("seed", range(4))
def test_an_inverse_orientation_or_quaternion_order_is_told_from_a_wrong_rate(way, seed):
    orientations, rates = turning(SECONDS, seed=seed)
    check = AngularVelocityCheck()
    check.checked(block(INVERSES[way](orientations), rates))
    assert check.faults == {"torso": RateFault.INVERSE}
    assert check.inverse == {"torso"}


def test_imus_that_hardly_turn_are_inverse_if_two_others_are_and_none_is_sound():
    orientations, rates = turning(SECONDS)
    still, no_rates = turning(SECONDS, speed=0.02)
    check = AngularVelocityCheck()
    for name in ("torso", "left_thigh"):
        check.checked(block(orientations.inv(), rates, name))
    check.checked(block(still.inv(), no_rates, "head"))
    assert check.inverse == {"torso", "left_thigh", "head"}
    check.checked(block(orientations, rates, "pelvis"))
    assert check.inverse == {"torso", "left_thigh"}


def test_samples_of_inverse_orientations_are_not_used():
    orientations, rates = turning(SECONDS)
    imus, given = ImuSet(), block(orientations.inv(), rates)
    for rows in np.array_split(np.arange(len(rates)), 20):
        imus.add(given.rows(rows))
    assert imus.inverse == {"torso"}
    assert len(imus.read(int(given.stamps_ns[-1]))) == 0


def test_an_orientation_that_may_be_the_inverse_is_not_used_until_turns_about_other_axes_decide():
    _, rates = turning(10.0)
    rates = rates * [1.0, 0.0, 0.0]
    orientations = Rotation.from_rotvec(np.cumsum(rates, axis=0) * PERIOD_S)
    imus, given = ImuSet(), block(orientations.inv(), rates)
    used = []
    for rows in np.array_split(np.arange(len(rates)), 20):
        imus.add(given.rows(rows))
        used.append(imus.history.newest_ns("torso") == given.stamps_ns[rows[-1]])
    assert imus.inverse == frozenset()
    assert not used[5]
    assert used[-1]  # turns about one axis are all it has
