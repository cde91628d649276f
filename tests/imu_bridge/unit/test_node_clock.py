"""Mapping of node clocks to host stamps."""

import numpy as np
import pytest

from imu_bridge.node_clock import NodeClock

MS = 1_000_000  # [ns]
WRAP = 2**32  # [us]
START_NS = 1_700_000_000_000_000_000


def test_stamps_are_as_regular_as_the_nodes_clock_under_a_jittery_link():
    rng = np.random.default_rng(1)
    samples = 6000
    capture_ns = START_NS + np.arange(samples) * 10 * MS
    node_us = (np.arange(samples) * 10_000 * (1 + 40e-6)).astype(int)  # the node runs fast
    arrival_ns = capture_ns + 2 * MS + rng.exponential(4 * MS, samples).astype(int)
    clock = NodeClock()

    stamps = np.array(
        [
            clock.stamp(int(u), int(a)).stamp_ns
            for u, a in zip(node_us, np.maximum.accumulate(arrival_ns), strict=True)
        ]
    )

    error_ms = (stamps - capture_ns)[500:] / MS - 2.0  # the least delay cannot be known
    assert np.abs(error_ms).max() < 0.5
    assert np.abs(np.diff(stamps) / MS - 10.0)[500:].max() < 0.5
    assert clock.counters.as_dict() == {"clock_jumps": 0, "clock_steps": 0, "stamps_held": 0}


@pytest.mark.parametrize("drift", [-80e-6, 80e-6])
def test_the_mapping_follows_a_drifting_clock(drift: float):
    clock = NodeClock()
    for k in range(0, 360_000, 10):  # an hour, ten samples a second
        stamp = clock.stamp(round(k * 10_000 * (1 + drift)) % WRAP, START_NS + k * 10 * MS)
    assert stamp.stamp_ns == pytest.approx(START_NS + k * 10 * MS, abs=0.05 * MS)


def test_the_clock_may_wrap():
    clock = NodeClock()
    first = clock.stamp(WRAP - 4_000, START_NS)
    second = clock.stamp(6_000, START_NS + 10 * MS)
    assert second.stamp_ns - first.stamp_ns == 10 * MS
    assert second.elapsed_s == pytest.approx(0.01)
    assert clock.counters["clock_jumps"] == 0


def test_a_silence_of_several_wraps_is_bridged_by_the_hosts_clock():
    clock = NodeClock()
    clock.stamp(1_000, START_NS)
    silence_us = 3 * WRAP + 123_456
    time = clock.stamp(1_000 + 123_456, START_NS + silence_us * 1000)
    assert time.elapsed_s == pytest.approx(silence_us * 1e-6)
    assert clock.counters["clock_jumps"] == 0


@pytest.mark.parametrize("uptime_us", [50_000_000, 3_000_000_000])
def test_a_restart_is_counted_and_begins_the_mapping_anew(uptime_us: int):
    clock = NodeClock()
    clock.stamp(uptime_us, START_NS)
    time = clock.stamp(700, START_NS + 900 * MS)
    assert time.elapsed_s is None
    assert time.stamp_ns == START_NS + 900 * MS
    assert clock.counters["clock_jumps"] == 1


def test_a_delayed_burst_keeps_its_spacing():
    clock = NodeClock()
    for k in range(100):
        clock.stamp(k * 10_000, START_NS + k * 10 * MS)
    late = START_NS + 1300 * MS
    stamps = [clock.stamp(k * 10_000, late).stamp_ns for k in range(100, 130)]
    np.testing.assert_allclose(np.diff(stamps), 10 * MS, atol=0.01 * MS)
    assert clock.counters["clock_jumps"] == 0


def test_a_backlog_at_the_start_is_discarded():
    clock = NodeClock()
    backlog = START_NS + 500 * MS  # 50 samples that waited in the driver
    for k in range(50):
        clock.stamp(k * 10_000, backlog)
    time = clock.stamp(500_000, START_NS + 500 * MS + 10)
    assert time.stamp_ns - START_NS == pytest.approx(500 * MS, abs=0.1 * MS)
    assert clock.counters["stamps_held"] > 0
