"""Clocks from motion, on the synthetic subject: Kinects against each other, and against IMUs."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from fusing import blocks_between_frames

from pose_bench.sessions import SessionSpec, bench_session
from pose_calibration.clocks.clock_offset import estimate_clock_offset
from pose_calibration.clocks.joint_delays import Delay
from pose_calibration.inertial.imu_clock import clearly_apart, imu_findings
from pose_calibration.inertial.imu_memory import ImuMemory
from pose_calibration.live.clock_tracking import EVERY_NS, ClockTracker
from pose_calibration.session_calibration import calibrate
from pose_core.joints import other_side
from pose_core.stamps import NS_PER_S
from pose_core.streams.clocks import IMUS, ONE_IMU
from pose_core.streams.samples import ImuBlock, ImuSample, joined

STEADY = {"kinect": {"inertia": 0.0, "lag": 0.0}}  # trackers that follow all joints alike


@cache
def session(choreography, seed, offset_s, overrides=(), imus=False, duration_s=40.0):
    spec = SessionSpec(
        choreography=choreography,
        level="typical",
        seed=seed,
        duration_s=duration_s,
        clock_offset_s=offset_s,
    )
    return bench_session(spec, imus=imus, overrides=STEADY if overrides == "steady" else None)


def of(skeletons, sensor):
    return [one for one in skeletons if one.sensor == sensor]


def delayed(samples, offset_ns, drift=0.0):
    """The samples as a clock stamps them that is ahead, and gains."""
    begin_ns = samples[0].stamp_ns
    return [
        replace(one, stamp_ns=one.stamp_ns + offset_ns + round(drift * (one.stamp_ns - begin_ns)))
        for one in samples
    ]


@pytest.mark.parametrize(
    ("choreography", "seed", "offset_s"),
    [
        ("dance", 1, 0.48),
        ("twisting", 34, 0.281),  # evenly repeated: other shifts agree nearly as well
        ("squats", 2, -0.33),
        ("walk_turns", 3, 0.08),
        ("leg_lift_march", 4, -0.5),
    ],
)
def test_offsets_are_found_to_5_ms_where_trackers_have_no_lags_of_their_own(
    choreography, seed, offset_s
):
    skeletons = session(choreography, seed, offset_s, "steady").skeletons
    found = estimate_clock_offset(of(skeletons, "left"), of(skeletons, "right"))
    newest_ns = of(skeletons, "right")[-1].stamp_ns
    assert found.clock.ahead_ns(newest_ns) * 1e-9 == pytest.approx(offset_s, abs=0.005)


def test_with_lags_of_typical_trackers_the_error_agrees_with_the_standard_deviation():
    skeletons = session("dance", 1, 0.1).skeletons
    found = estimate_clock_offset(of(skeletons, "left"), of(skeletons, "right"))
    assert found.estimate_s == pytest.approx(0.1, abs=3.0 * found.stddev_s)
    assert found.stddev_s < 0.006


def test_a_clock_that_gains_is_found_within_seconds_and_then_followed_to_5_ms():
    drift = 8e-5
    skeletons = session("dance", 1, 0.0, "steady", duration_s=60.0).skeletons
    left = of(skeletons, "left")
    right = delayed(of(skeletons, "right"), 200_000_000, drift)
    known = bench_session_extrinsics()
    tracker = ClockTracker(known, max_offset_s=0.5)
    begin_ns = right[0].stamp_ns
    errors_s, told_s = [], []
    for one in sorted([*left, *right], key=lambda sample: sample.stamp_ns):
        clocks = tracker.add(one, ImuMemory())
        if clocks and "right" in clocks:
            told_s.append((one.stamp_ns - begin_ns) * 1e-9)
            true_ns = 200_000_000 + round(drift * (one.stamp_ns - begin_ns))
            errors_s.append((clocks["right"].ahead_ns(one.stamp_ns) - true_ns) * 1e-9)
    assert told_s[0] < 6.5
    assert abs(errors_s[0]) < 0.03  # the first search, of four seconds
    assert len(told_s) >= 3
    assert np.abs(errors_s[1:]).max() < 0.005
    assert tracker.clocks["right"].stddev_s < 0.01


def bench_session_extrinsics():
    placed = session("dance", 1, 0.0, "steady", duration_s=60.0).extrinsics
    return replace(placed, clocks={})


def test_a_clock_that_is_set_is_estimated_again():
    skeletons = session("dance", 1, 0.0, "steady", duration_s=60.0).skeletons
    left, right = of(skeletons, "left"), of(skeletons, "right")
    middle_ns = left[0].stamp_ns + 2 * EVERY_NS
    right = [
        replace(one, stamp_ns=one.stamp_ns + (300_000_000 if one.stamp_ns > middle_ns else 0))
        for one in right
    ]
    tracker = ClockTracker(bench_session_extrinsics(), max_offset_s=0.5)
    for one in sorted([*left, *right], key=lambda sample: sample.stamp_ns):
        tracker.add(one, ImuMemory())
    assert tracker.clocks["right"].offset_ns == pytest.approx(300e6, abs=6e6)


def findings(offset_s, overrides="steady", single=None):
    """Findings with the IMUs' clock ahead, and single ones' by as much more, by segment."""
    one = session("dance", 3, 0.0, overrides, imus=True)
    memory = ImuMemory()
    block = joined(one.imus)
    ahead_s = [offset_s + (single or {}).get(name, 0.0) for name in block.segments]
    ahead_ns = np.rint(np.array(ahead_s) * 1e9).astype(np.int64)
    memory.add(replace(block, stamps_ns=block.stamps_ns + ahead_ns[block.imu]))
    skeletons = {name: of(one.skeletons, name) for name in ("left", "right")}
    return imu_findings(one.extrinsics, skeletons, memory, 0.5)


@pytest.mark.parametrize("offset_s", [0.45, -0.3])
def test_the_imus_clock_is_estimated_with_its_uncertainty(offset_s):
    found = findings(offset_s, overrides=())
    assert set(found.clocks) == {IMUS}
    assert found.offset_s == pytest.approx(offset_s, abs=2.0 * found.offset_stddev_s)
    assert found.offset_stddev_s < 0.02


def test_imus_on_the_same_computer_are_left_alone():
    found = findings(0.0, overrides=())
    assert np.isfinite(found.offset_stddev_s)
    assert not found.clocks


@pytest.mark.parametrize("offset_s", [0.0, 0.45])
@pytest.mark.parametrize("segment", ["left_thigh", "left_shank"])
def test_exchanged_legs_that_step_evenly_do_not_shift_the_clock(segment, offset_s):
    """Half a step later, they would fit as well on their own sides."""
    one = session("leg_lift_march", 3, 0.0, "steady", imus=True)
    other = other_side(segment)
    legs = ("left_thigh", "right_thigh", "left_shank", "right_shank")
    worn = [sample for sample in one.imus if sample.segment in legs]
    block = joined(worn)
    exchanged = {segment: other, other: segment}
    memory = ImuMemory()
    memory.add(
        replace(
            block,
            segments=tuple(exchanged.get(name, name) for name in block.segments),
            stamps_ns=block.stamps_ns + round(offset_s * NS_PER_S),
        )
    )
    skeletons = {name: of(one.skeletons, name) for name in ("left", "right")}
    found = imu_findings(one.extrinsics, skeletons, memory, 0.5)
    assert set(found.clocks) == ({IMUS} if offset_s else set())
    assert found.offset_s == pytest.approx(offset_s, abs=0.06)


@pytest.mark.parametrize("ahead_s", [-0.3, -0.18, 0.15, 0.3])
@pytest.mark.parametrize("segment", ["left_forearm", "right_upper_arm"])
def test_an_imu_whose_clock_differs_from_the_others_is_found(segment, ahead_s):
    found = findings(0.0, overrides=(), single={segment: ahead_s}).clocks
    assert set(found) == {ONE_IMU + segment}
    own = found[ONE_IMU + segment]
    assert own.offset_ns * 1e-9 == pytest.approx(ahead_s, abs=3.0 * own.stddev_s)
    assert own.stddev_s < 0.03


def test_a_single_imus_clock_does_not_spoil_the_common_one():
    sound = findings(0.0, overrides=())
    found = findings(0.0, overrides=(), single={"left_thigh": 0.15})
    assert set(found.clocks) == {ONE_IMU + "left_thigh"}
    assert found.offset_s == pytest.approx(sound.offset_s, abs=2.0 * sound.offset_stddev_s)


def test_where_half_of_the_imus_differ_no_clock_is_accused():
    ahead = {name: Delay(estimate_s=0.1, stddev_s=0.02) for name in ("left_thigh", "left_shank")}
    ahead |= {name: Delay(estimate_s=-0.1, stddev_s=0.02) for name in ("torso", "right_thigh")}
    assert not clearly_apart(ahead, {})
    assert not clearly_apart({**ahead, "torso": Delay(estimate_s=0.0, stddev_s=0.02)}, {})
    sound = {name: Delay(estimate_s=0.0, stddev_s=0.02) for name in ("torso", "head", "pelvis")}
    assert set(clearly_apart({**sound, "left_thigh": ahead["left_thigh"]}, {})) == {"left_thigh"}


def test_a_clock_is_not_accused_of_what_would_have_its_samples_arrive_before_they_are_taken():
    sound = {name: Delay(estimate_s=0.0, stddev_s=0.02) for name in ("torso", "head", "pelvis")}
    behind = {**sound, "left_thigh": Delay(estimate_s=-0.13, stddev_s=0.02)}
    assert clearly_apart(behind, {"left_thigh": 0.0}) == {}
    assert set(clearly_apart(behind, {"left_thigh": -0.12})) == {"left_thigh"}


def test_live_an_imus_clock_is_corrected_until_it_is_right_again():
    one = session("dance", 3, 0.0, imus=True, duration_s=100.0)
    memory = ImuMemory()
    tracker = ClockTracker(replace(one.extrinsics, clocks={}), max_offset_s=0.5)
    begin_ns = one.skeletons[0].stamp_ns
    right_ns = begin_ns + 52 * NS_PER_S

    def stamped(sample):
        ahead = isinstance(sample, ImuSample) and sample.segment == "left_forearm"
        ahead_ns = 200_000_000 if ahead and sample.stamp_ns < right_ns else 0
        return replace(sample, stamp_ns=sample.stamp_ns + ahead_ns)

    ahead_s = []  # after each measurement
    samples = sorted([*one.skeletons, *one.imus], key=lambda each: each.stamp_ns)
    for each in blocks_between_frames(map(stamped, samples)):
        if isinstance(each, ImuBlock):
            memory.add(each)
        elif (clocks := tracker.add(each, memory)) is not None:
            assert set(clocks) <= {"right", "imus/left_forearm"}
            clock = clocks.get("imus/left_forearm")
            ahead_s.append(None if clock is None else clock.offset_ns / NS_PER_S)
    assert ahead_s[:4] == [None] * 4
    assert ahead_s[4] == pytest.approx(0.2, abs=0.06)
    assert ahead_s[-1] is None


@pytest.mark.parametrize("offset_s", [1.7, -4.2])
def test_in_a_recording_clocks_that_are_seconds_apart_are_found(offset_s):
    one = session("dance", 3, 0.0, imus=True)
    offset_ns = round(offset_s * 1e9)
    right = delayed(of(one.skeletons, "right"), offset_ns)
    imus = delayed(one.imus, -offset_ns)

    found = calibrate([*of(one.skeletons, "left"), *right, *imus], ("left", "right")).extrinsics

    assert found.clocks["right"].offset_ns * 1e-9 == pytest.approx(offset_s, abs=0.03)
    assert found.clocks[IMUS].offset_ns * 1e-9 == pytest.approx(-offset_s, abs=0.06)


def test_two_offsets_of_the_imus_differ_by_what_they_differ_to_5_ms():
    """Trackers' lag is the same in both: what is left is the search itself."""
    apart_s = findings(0.45).offset_s - findings(-0.3).offset_s
    assert apart_s == pytest.approx(0.75, abs=0.005)


@pytest.mark.parametrize("way", ["inverse", "w x y z"])
def test_imus_whose_orientations_are_refused_give_no_clock_and_no_vertical(way):
    one = session("dance", 3, 0.0, imus=True)
    turn = {"inverse": [-1, -1, -1, 1], "w x y z": [1, 1, 1, 1]}[way]
    imus = [
        replace(each, orientation=np.roll(each.orientation * turn, 1 if way == "w x y z" else 0))
        for each in one.imus
    ]
    alone = calibrate(one.skeletons, ("left", "right"))

    found = calibrate([*one.skeletons, *imus], ("left", "right"))

    assert found.imus is None
    assert found.extrinsics.clocks == alone.extrinsics.clocks
    np.testing.assert_array_equal(
        found.extrinsics.T_map_reference, alone.extrinsics.T_map_reference
    )
