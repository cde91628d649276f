"""Stamps that cannot be true are not used; a clock that leaps is found out."""

from types import MappingProxyType

import numpy as np
import pytest

from pose_core.joints import JOINTS
from pose_core.streams.clocks import IMUS, Clock
from pose_core.streams.samples import ImuBlock, SkeletonSample
from pose_core.streams.stamp_check import StampCheck

MS = 1_000_000
S = 1000 * MS
START = 1_700_000_000 * S
PERIOD = 33 * MS
LAG = 30 * MS


def sample(stamp_ns, sensor="left"):
    return SkeletonSample(
        stamp_ns=stamp_ns,
        sensor=sensor,
        person="1",
        positions=np.zeros((len(JOINTS), 3)),
        tracking_state=np.zeros(len(JOINTS), np.uint8),
    )


def imu_block(*stamps_ns):
    """One sample of each IMU."""
    count = len(stamps_ns)
    return ImuBlock(
        segments=("torso", "left_thigh")[:count],
        imu=np.arange(count),
        stamps_ns=np.array(stamps_ns),
        orientation=np.tile([0.0, 0.0, 0.0, 1.0], (count, 1)),
        orientation_stddev=np.zeros((count, 3)),
        angular_velocity=np.zeros((count, 3)),
        linear_acceleration=np.zeros((count, 3)),
    )


def feed(
    check,
    seconds,
    stamp_of,
    *,
    start_s=0.0,
    period_ns=PERIOD,
    sensor="left",
    clocks=MappingProxyType({}),
):
    """Samples whose stamp is a function of the true instant; those used, by true instant [s]."""
    used = {}
    for k in range(round(seconds * S / period_ns)):
        true_ns = START + round(start_s * S) + k * period_ns
        result = check.skeleton(sample(stamp_of(true_ns), sensor), true_ns + LAG, clocks)
        if result is not None:
            used[(true_ns - START) / S] = result.stamp_ns - true_ns
    return used


def test_plausible_stamps_pass_unchanged():
    check = StampCheck()
    used = feed(check, 3.0, lambda true_ns: true_ns)
    assert len(used) == 91
    assert set(used.values()) == {0}
    assert not check.excluded
    assert sum(check.counters.as_dict().values()) == 0


@pytest.mark.parametrize("leap_s", [5.0, -5.0, 31_536_000.0, 1.0, 0.2])
def test_after_a_clock_step_a_source_is_rejected_and_then_used_with_its_offset(leap_s):
    check = StampCheck()
    feed(check, 2.0, lambda true_ns: true_ns)
    used = feed(check, 3.0, lambda true_ns: true_ns + round(leap_s * S), start_s=2.0)
    assert min(used) == pytest.approx(3.0, abs=0.15)  # a second later
    assert max(abs(error_ns) for error_ns in used.values()) < 20 * MS
    assert check.counters["clocks_taken_in_again"] == 1
    back = feed(check, 3.0, lambda true_ns: true_ns, start_s=5.0)
    assert set(back.values()) == {0}
    assert not check.excluded
    assert not check.offsets_s


@pytest.mark.parametrize(
    ("stamp_of", "reason"),
    [
        (lambda true_ns: 2 * START + 2 * S - true_ns, "behind"),
        (lambda true_ns: 0, "stamps are zero: set header.stamp"),
        (lambda true_ns: -true_ns, "behind"),
        (lambda true_ns: true_ns - S, "1.0 s behind"),
        (lambda true_ns: 2 * true_ns - START - 2 * S, "ahead"),
    ],
)
def test_a_source_of_implausible_stamps_is_rejected_and_reported(stamp_of, reason):
    check = StampCheck()
    feed(check, 2.0, lambda true_ns: true_ns)
    used = feed(check, 5.0, stamp_of, start_s=2.0)
    assert all(abs(error_ns) <= 500 * MS for error_ns in used.values())
    assert all(at_s < 2.6 for at_s in used)
    assert reason in check.excluded["left"]
    assert check.counters["clocks_set_aside"] == 1
    assert feed(check, 3.0, lambda true_ns: true_ns, start_s=7.0)


@pytest.mark.parametrize("held_s", [1.0, 4.0, 30.0])
def test_samples_that_a_link_has_held_back_are_not_used_until_they_are_in_time(held_s):
    check = StampCheck()
    feed(check, 2.0, lambda true_ns: true_ns)
    late = {"start_s": 2.0 + held_s}
    assert not feed(check, 5.0, lambda true_ns: true_ns - round(held_s * S), **late)
    assert f"{held_s:.1f} s behind" in check.excluded["left"]
    assert not check.offsets_s
    used = feed(check, 1.0, lambda true_ns: true_ns, start_s=7.0 + held_s)
    assert len(used) == 29
    assert not check.excluded


def test_a_lag_that_grows_slowly_is_not_taken_for_a_clock():
    check = StampCheck()
    feed(check, 2.0, lambda true_ns: true_ns)
    feed(check, 10.0, lambda true_ns: true_ns - (true_ns - START - 2 * S) // 2, start_s=2.0)
    assert not feed(check, 3.0, lambda true_ns: true_ns - 5 * S, start_s=12.0)


def test_two_clocks_that_jump_by_nearly_the_same_have_offsets_of_their_own():
    check = StampCheck()
    for sensor, leap_s in (("left", -3.0), ("right", -3.2)):
        feed(check, 2.0, lambda true_ns: true_ns, sensor=sensor)
        used = feed(
            check,
            3.0,
            lambda true_ns, by_s=leap_s: true_ns + round(by_s * S),
            start_s=2.0,
            sensor=sensor,
        )
        assert max(map(abs, used.values())) < 20 * MS


def test_a_single_wrong_stamp_is_rejected_alone():
    check = StampCheck()
    feed(check, 1.0, lambda true_ns: true_ns)
    assert check.skeleton(sample(START + 400 * S), START + S, {}) is None
    assert len(feed(check, 1.0, lambda true_ns: true_ns, start_s=1.0)) == 30
    assert check.counters["stamps_ahead"] == 1


def test_a_flood_is_limited_to_120_frames_per_second_and_repeated_stamps_are_dropped():
    check = StampCheck()
    used = feed(check, 2.0, lambda true_ns: true_ns, period_ns=MS)
    assert len(used) == pytest.approx(2 * 120 + 12, abs=2)
    repeated = feed(
        check, 1.0, lambda true_ns: true_ns // PERIOD * PERIOD, start_s=3.0, period_ns=MS
    )
    assert len(repeated) <= 31


def test_frames_are_used_again_once_they_are_no_longer_late():
    check = StampCheck()
    feed(check, 1.0, lambda true_ns: true_ns)
    feed(check, 1.0, lambda true_ns: true_ns - S, start_s=1.0)
    assert check.excluded
    assert len(feed(check, 1.0, lambda true_ns: true_ns, start_s=2.0)) == 29
    assert not check.excluded


@pytest.mark.parametrize("spread_s", [0.0, 5.0])
def test_two_sources_of_one_name_are_rejected_until_one_has_stopped(spread_s):
    check, rng = StampCheck(), np.random.default_rng(1)
    turn = iter(range(10_000))

    def of_two(true_ns):
        other_s = -60.0 if spread_s == 0.0 else rng.uniform(-spread_s, spread_s)
        return true_ns + (round(other_s * S) if next(turn) % 2 else 0)

    feed(check, 1.0, lambda true_ns: true_ns)
    used = feed(check, 4.0, of_two, start_s=1.0, period_ns=PERIOD // 2)
    assert max(used) < 1.5
    assert check.excluded
    back = feed(check, 3.0, lambda true_ns: true_ns, start_s=5.0)
    assert min(back) < 6.2
    assert set(back.values()) == {0}


@pytest.mark.parametrize(("steps_ms", "reason"), [(60, set()), (400, {"stamps stand still"})])
def test_stamps_may_repeat_for_a_fifth_of_a_second(steps_ms, reason):
    check, reasons = StampCheck(), set()
    for first_s in np.arange(0.0, 3.0, 0.1):
        feed(
            check,
            0.1,
            lambda true_ns: true_ns // (steps_ms * MS) * steps_ms * MS,
            start_s=first_s,
            period_ns=10 * MS,
        )
        reasons |= set(check.excluded.values())
    assert reasons == reason


def test_before_simulated_time_begins_no_sample_is_used_and_no_clock_is_blamed():
    check = StampCheck()
    assert all(check.skeleton(sample(START + k * PERIOD), 0, {}) is None for k in range(9))
    assert not check.excluded
    assert feed(check, 1.0, lambda true_ns: true_ns)


def test_a_source_that_often_repeats_a_stamp_is_used_again():
    def stamp_of(true_ns):
        k = (true_ns - START) // PERIOD
        ahead_ns = 500 * MS if true_ns < START + S else 0
        return true_ns + ahead_ns - (PERIOD if k % 7 == 0 else 0)

    check = StampCheck()
    used = feed(check, 10.0, stamp_of)
    assert not check.excluded
    assert len([at_s for at_s in used if at_s > 4.0]) > 0.8 * 6.0 * S / PERIOD


def test_sources_of_one_stepped_clock_get_the_same_offset():
    check = StampCheck()
    for sensor in ("left", "right"):
        feed(check, 1.0, lambda true_ns: true_ns, sensor=sensor)
    for sensor, jitter_ns in (("left", 0), ("right", 12 * MS)):
        feed(
            check,
            2.0,
            lambda true_ns, more=jitter_ns: true_ns + 5 * S - more,
            start_s=1.0,
            sensor=sensor,
        )
    assert check.offsets_s["left"] == check.offsets_s["right"]


def test_a_known_clock_offset_is_not_a_clock_step():
    check = StampCheck()
    clocks = {"left": Clock(offset_ns=3 * S)}
    assert check.skeleton(sample(START + 3 * S), START + LAG, clocks) is not None


def test_a_delayed_imu_is_rejected_and_the_others_are_used():
    check = StampCheck()
    for k in range(100):
        now_ns = START + k * 10 * MS
        block = imu_block(now_ns - 400 * MS, now_ns - 5 * MS)
        assert check.imus(block, np.full(2, now_ns), {}).imu.tolist() == [1]
    assert list(check.excluded) == ["imus/torso"]


@pytest.mark.parametrize("ahead_s", [0.36, -0.7, 3.0])
def test_a_clock_that_is_calibrated_later_is_not_corrected_twice(ahead_s):
    ahead_ns = round(ahead_s * S)
    check = StampCheck()
    feed(check, 2.0, lambda true_ns: true_ns)
    feed(check, 3.0, lambda true_ns: true_ns + ahead_ns, start_s=2.0)
    clocks = {"left": Clock(offset_ns=ahead_ns)}
    used = feed(check, 3.0, lambda true_ns: true_ns + ahead_ns, start_s=5.0, clocks=clocks)
    assert min(used) == 5.0
    assert set(used.values()) == {ahead_ns}  # as stamped: the clock corrects it
    assert not check.offsets_s


def test_the_imus_clock_that_is_calibrated_later_is_not_corrected_twice():
    check, ahead_ns, used = StampCheck(), round(0.4 * S), 0
    for k in range(800):
        true_ns = START + k * 10 * MS
        block = imu_block(true_ns + (ahead_ns if k > 100 else 0))
        clocks = {IMUS: Clock(offset_ns=ahead_ns)} if k > 400 else {}
        passed = check.imus(block, np.full(1, true_ns + 10 * MS), clocks)
        used += k > 400 and len(passed) == 1
    assert used == 399
    assert not check.offsets_s
