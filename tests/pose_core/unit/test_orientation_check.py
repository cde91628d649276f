"""An IMU's orientation is held against its own gyroscope."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from turning_imus import START_NS, block, changed, turning

from pose_core.imu.imu_set import ImuSet
from pose_core.imu.orientation_check import OrientationCheck, orientation_jump


def angles_deg(one, other):
    return np.degrees((one.inv() * other).magnitude())


def test_consistent_orientations_pass_unchanged():
    rng = np.random.default_rng(2)
    orientations, rates = turning(5.0, speed=15.0)
    noisy = orientations * Rotation.from_rotvec(0.02 * rng.standard_normal((len(rates), 3)))
    check, given = OrientationCheck(), block(noisy, rates)
    checked = check.checked(given)
    assert np.array_equal(checked.orientation, given.orientation)
    assert not check.excluded
    assert not check.headings


@pytest.mark.parametrize("leap_deg", [60.0, -150.0, 180.0])
def test_heading_steps_are_compensated(leap_deg):
    orientations, rates = turning(5.0)
    turn = Rotation.from_euler("z", leap_deg, degrees=True)
    jumped = changed(orientations, slice(100, 300), lambda some: turn * some)
    check = OrientationCheck()
    first, second = (block(jumped, rates).rows(rows) for rows in (slice(0, 200), slice(200, 500)))
    before, after = check.checked(first), check.checked(second)
    assert len(before) == 199
    used = Rotation.from_quat(np.concatenate([before.orientation, after.orientation]))
    rows = np.delete(np.arange(500), [100, 300])
    assert angles_deg(used, orientations[rows]).max() < 0.1
    assert abs(check.headings.get("torso", 0.0)) < 1e-3


@pytest.mark.parametrize("speed", [0.5, 10.0])
def test_an_imu_with_random_orientations_is_rejected_until_consistent_for_a_second(speed):
    orientations, rates = turning(5.0, speed=speed)
    window = slice(100, 300)
    wild = changed(orientations, window, lambda some: Rotation.random(len(some), random_state=4))
    check, given = OrientationCheck(), block(wild, rates)
    used = check.checked(given.rows(slice(0, 300)))
    assert used.stamps_ns[-1] <= given.stamps_ns[102]
    assert check.excluded == ("torso",)
    back = check.checked(given.rows(slice(300, 500)))
    assert back.stamps_ns[0] - given.stamps_ns[300] == pytest.approx(1e9, abs=2e7)
    assert not check.excluded


def slipped_by(degrees, window):
    """A sensor that sits otherwise from a sample on, for a while."""
    orientations, rates = turning(3.0)
    turn = Rotation.from_euler("y", degrees, degrees=True)
    rates[window] = turn.inv().apply(rates[window])
    return block(changed(orientations, window, lambda some: some * turn), rates)


@pytest.mark.parametrize("degrees", [25.0, 90.0])
def test_a_slip_is_detected_and_costs_30_ms(degrees):
    check = OrientationCheck()
    assert len(check.checked(slipped_by(degrees, slice(100, 300)))) == 297
    assert check.slips == {"torso": 1}
    assert not check.excluded
    assert not check.headings
    assert not check.jumping


@pytest.mark.parametrize(("degrees", "count"), [(90.0, 1), (90.0, 2), (15.0, 200)])
def test_outliers_and_small_rotations_are_not_detected_as_slips(degrees, count):
    check = OrientationCheck()
    check.checked(slipped_by(degrees, slice(100, 100 + count)))
    assert not check.slips


def test_a_heading_step_is_not_detected_as_a_slip():
    orientations, rates = turning(3.0)
    turn = Rotation.from_euler("z", 60.0, degrees=True)
    check = OrientationCheck()
    check.checked(block(changed(orientations, slice(100, 300), lambda some: turn * some), rates))
    assert not check.slips


@pytest.mark.parametrize("speed", [0.01, 4.0])
def test_an_imu_that_repeats_one_sample_is_rejected(speed):
    orientations, rates = turning(3.0, speed=speed)
    rates[100:250] = rates[100]
    stuck = changed(orientations, slice(100, 250), lambda some: some[np.zeros(len(some), int)])
    check, given = OrientationCheck(), block(stuck, rates)
    check.checked(given.rows(slice(0, 150)))
    assert check.excluded == check.jumping == ("torso",)
    assert len(check.checked(given.rows(slice(150, 250)))) == 0


def test_an_imu_that_repeats_its_orientation_while_its_gyroscope_turns_is_rejected():
    orientations, rates = turning(4.0)
    stuck = changed(orientations, slice(100, 200), lambda some: some[np.zeros(len(some), int)])
    check = OrientationCheck()
    given = block(stuck, rates)
    assert len(check.checked(given.rows(slice(0, 200)))) < 140
    assert check.excluded == ("torso",)
    again = check.checked(given.rows(slice(200, 400)))
    assert len(again) > 90
    assert not check.slips
    assert not check.headings


def test_a_gyroscopes_noise_is_no_turn():
    rng = np.random.default_rng(4)
    orientations = Rotation.from_quat(np.tile([0.0, 0.0, 0.0, 1.0], (3000, 1)))
    rates = 0.02 + 0.03 * rng.standard_normal((3000, 3))
    assert len(OrientationCheck().checked(block(orientations, rates))) == 3000


def test_a_stationary_sensor_may_repeat_its_samples():
    orientations = Rotation.from_quat(np.tile([0.0, 0.0, 0.0, 1.0], (300, 1)))
    rates = np.zeros((300, 3))
    assert len(OrientationCheck().checked(block(orientations, rates))) == 300


def test_an_orientation_jump_equals_the_applied_rotation():
    rng = np.random.default_rng(3)
    for _ in range(50):
        before, rate = Rotation.random(random_state=rng), rng.uniform(-5.0, 5.0, 3)
        turn, tilt = rng.uniform(-3.0, 3.0), rng.uniform(0.0, 0.05)
        by = Rotation.from_euler("z", turn) * Rotation.from_euler("x", tilt)
        after = by * before * Rotation.from_rotvec(0.02 * rate)
        apart, tilted, turned = orientation_jump(
            before.as_quat(), rate, after.as_quat(), rate, 0.02
        )
        if by.magnitude() > 0.31:
            assert (apart, tilted, turned) == pytest.approx((by.magnitude(), tilt, turn), abs=1e-6)


def test_samples_after_a_gap_or_a_clock_reset_are_not_checked():
    orientations, rates = turning(1.0)
    check, given = OrientationCheck(), block(orientations, rates)
    check.checked(given)
    assert len(check.checked(given)) == len(given)
    assert len(check.checked(given.rows(np.arange(0, 100, 20)))) == 5


def test_samples_of_a_saturated_gyroscope_are_rejected_for_two_seconds():
    orientations, rates = turning(6.0, speed=12.0)
    clipped = rates.copy()
    clipped[:300] = np.clip(rates[:300], -5.0, 5.0)
    clipped[300:] *= 0.4  # slow again
    given = block(orientations, clipped)
    at_limit = np.abs(clipped[:300]).max(axis=1) == 5.0
    second = np.flatnonzero(at_limit[:-1] & at_limit[1:])[0] + 1
    used = OrientationCheck().checked(given).stamps_ns
    assert not np.any((used > given.stamps_ns[second]) & (used < given.stamps_ns[300]))
    assert used[used > given.stamps_ns[300]].min() > given.stamps_ns[200] + 2e9


def test_a_saturated_gyroscope_is_named_as_that_not_as_silent():
    orientations, rates = turning(3.0, speed=12.0)
    imus = ImuSet()
    imus.add(block(orientations, np.clip(rates, -5.0, 5.0)))
    newest_ns = START_NS + 3_000_000_000
    assert imus.orientations.saturated == ("torso",)
    assert imus.silent(newest_ns) == ()
    assert imus.counters["imu_samples_saturated"] > 100
    assert imus.counters["imu_samples_against_gyroscope"] == 0


@pytest.mark.parametrize("rate_hz", [50, 100])
def test_a_kick_is_no_jump_though_samples_are_stamped_on_arrival(rate_hz):
    rng, period_s = np.random.default_rng(3), 1.0 / rate_hz
    t = np.arange(0.0, 6.0, 0.001)
    pulse = np.exp(-0.5 * ((t - np.round(t)) / 0.05) ** 2)
    rates = np.outer(pulse, [6.0, 20.0, 8.0])
    turned = Rotation.from_rotvec(np.outer(np.cumsum(pulse) * 0.001, [6.0, 20.0, 8.0]))
    rows = np.arange(10, len(t), round(period_s / 0.001))
    kicks = block(turned[rows], rates[rows])
    late_s = rng.normal(0.0, 0.004, len(rows))
    kicks = replace(kicks, stamps_ns=START_NS + np.rint(1e9 * (t[rows] + late_s)).astype(np.int64))
    check = OrientationCheck()
    assert len(check.checked(kicks)) == len(kicks)
    assert not check.jumping


def test_a_slip_in_a_slow_motion_is_found_however_stamps_jitter():
    rng, given = np.random.default_rng(3), slipped_by(25.0, slice(100, 300))
    late_ns = np.abs(rng.normal(0.0, 2e6, len(given))).astype(np.int64)
    check = OrientationCheck()
    check.checked(replace(given, stamps_ns=given.stamps_ns + late_ns))
    assert check.slips == {"torso": 1}
