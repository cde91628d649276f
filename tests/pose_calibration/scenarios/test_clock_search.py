"""Clocks from motion, on the synthetic subject: Kinects against each other, and against IMUs."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from pose_bench.sessions import SessionSpec, bench_session
from pose_calibration.clocks.clock_offset import estimate_clock_offset
from pose_calibration.inertial.imu_clock import imu_findings
from pose_calibration.inertial.imu_motion import ImuMemory
from pose_calibration.live.clock_tracking import EVERY_NS, ClockTracker
from pose_calibration.session_calibration import calibrate
from pose_core.streams.clocks import IMUS
from pose_core.streams.samples import block_of

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


def test_a_clock_that_gains_is_followed_to_5_ms():
    drift = 8e-5
    skeletons = session("dance", 1, 0.0, "steady", duration_s=60.0).skeletons
    left = of(skeletons, "left")
    right = delayed(of(skeletons, "right"), 200_000_000, drift)
    known = bench_session_extrinsics()
    tracker = ClockTracker(known, max_offset_s=0.5)
    begin_ns, told = right[0].stamp_ns, 0
    errors_s = []
    for one in sorted([*left, *right], key=lambda sample: sample.stamp_ns):
        clocks = tracker.add(one, ImuMemory())
        if clocks and "right" in clocks:
            told += 1
            true_ns = 200_000_000 + round(drift * (one.stamp_ns - begin_ns))
            errors_s.append((clocks["right"].ahead_ns(one.stamp_ns) - true_ns) * 1e-9)
    assert told >= 2
    assert np.abs(errors_s).max() < 0.005
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


def findings(offset_s, overrides="steady"):
    one = session("dance", 3, 0.0, overrides, imus=True)
    memory = ImuMemory()
    for sample in delayed(one.imus, round(offset_s * 1e9)):
        memory.add(block_of(sample))
    skeletons = {name: of(one.skeletons, name) for name in ("left", "right")}
    return imu_findings(one.extrinsics, skeletons, memory, 0.5)


@pytest.mark.parametrize("offset_s", [0.45, -0.3])
def test_the_imus_clock_is_estimated_with_its_uncertainty(offset_s):
    found = findings(offset_s, overrides=())
    assert found.clock is not None
    assert found.offset_s == pytest.approx(offset_s, abs=2.0 * found.offset_stddev_s)
    assert found.offset_stddev_s < 0.02


def test_imus_on_the_same_computer_are_left_alone():
    found = findings(0.0, overrides=())
    assert np.isfinite(found.offset_stddev_s)
    assert found.clock is None


@pytest.mark.parametrize("offset_s", [1.7, -4.2])
def test_in_a_recording_clocks_that_are_seconds_apart_are_found(offset_s):
    one = session("dance", 3, 0.0, imus=True)
    offset_ns = round(offset_s * 1e9)
    right = delayed(of(one.skeletons, "right"), offset_ns)
    imus = [block_of(sample) for sample in delayed(one.imus, -offset_ns)]

    found = calibrate([*of(one.skeletons, "left"), *right, *imus], ("left", "right")).extrinsics

    assert found.clocks["right"].offset_ns * 1e-9 == pytest.approx(offset_s, abs=0.03)
    assert found.clocks[IMUS].offset_ns * 1e-9 == pytest.approx(-offset_s, abs=0.06)


def test_two_offsets_of_the_imus_differ_by_what_they_differ_to_5_ms():
    """Trackers' lag is the same in both: what is left is the search itself."""
    apart_s = findings(0.45).offset_s - findings(-0.3).offset_s
    assert apart_s == pytest.approx(0.75, abs=0.005)
