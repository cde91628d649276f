"""Stamps under links that jitter, burst, stall and drift."""

import numpy as np
import pytest

from imu_bridge.node_clock import CountingClock, NodeClock

MS = 1_000_000  # [ns]
START_NS = 1_700_000_000_000_000_000
SAMPLES = 6000  # a minute at 100 Hz
SETTLED = 1000


def captured(skew: float = 0.0) -> np.ndarray:
    """When samples are taken, on the host's clock [ns]; the node's own ticks are 10 ms."""
    return START_NS + np.round(np.arange(SAMPLES) * 10 * MS * (1.0 + skew)).astype(np.int64)


def jittery(capture_ns: np.ndarray) -> np.ndarray:
    """Up to 20 ms late; frames keep their order."""
    late = np.random.default_rng(1).uniform(0.0, 20.0 * MS, SAMPLES).astype(np.int64)
    return np.maximum.accumulate(capture_ns + 2 * MS + late)


def crowded(capture_ns: np.ndarray) -> np.ndarray:
    """20 ms late on average, and one late frame keeps back all behind it."""
    late = np.random.default_rng(4).exponential(20.0 * MS, SAMPLES).astype(np.int64)
    return np.maximum.accumulate(capture_ns + 2 * MS + late)


def buffered(capture_ns: np.ndarray) -> np.ndarray:
    """A USB adapter that hands on what it has every 16 ms."""
    late = np.random.default_rng(2).exponential(0.3 * MS, SAMPLES).astype(np.int64)
    return np.maximum.accumulate(-(-capture_ns // (16 * MS)) * 16 * MS + late)


def stalled(capture_ns: np.ndarray) -> np.ndarray:
    """A host that is busy for 1.5 s now and then."""
    arrival_ns = capture_ns + np.random.default_rng(3).integers(0, 5 * MS, SAMPLES)
    for first in range(500, SAMPLES - 150, 1700):
        arrival_ns[first : first + 150] = capture_ns[first + 150]
    return np.maximum.accumulate(arrival_ns)


def deviation_ms(stamps: np.ndarray, capture_ns: np.ndarray) -> np.ndarray:
    """Of the stamps from their usual, unknowable lateness."""
    late = (stamps - capture_ns) / MS
    return np.abs(late - np.median(late[SETTLED:]))


def stamps_of(arrival_ns: np.ndarray, clock: NodeClock) -> np.ndarray:
    ticks = (4_294_000_000 + 10_000 * np.arange(SAMPLES)) % 2**32  # the counter wraps
    pairs = zip(ticks.tolist(), arrival_ns.tolist(), strict=True)
    return np.array([clock.stamp(us, ns).stamp_ns for us, ns in pairs])


@pytest.mark.parametrize("link", [jittery, crowded, buffered, stalled])
@pytest.mark.parametrize("skew", [0.0, 50e-6, -300e-6, 900e-6])
def test_stamps_are_within_2_ms_of_the_capture_whatever_the_link_does(link, skew: float):
    capture_ns, clock = captured(skew), NodeClock()
    error_ms = deviation_ms(stamps_of(link(capture_ns), clock), capture_ns)
    assert np.percentile(error_ms[SETTLED:], 99) < 2.0
    assert clock.counters["clock_jumps"] == 0


def test_arrivals_of_the_jittery_link_jitter_by_more_than_ten_times_as_much():
    capture_ns = captured()
    arrival_ns = jittery(capture_ns)
    jitter_ms = np.std((arrival_ns - capture_ns) / MS)
    assert jitter_ms > 5.0
    assert np.std(deviation_ms(stamps_of(arrival_ns, NodeClock()), capture_ns)[SETTLED:]) < 0.5


def test_the_drift_is_found_to_a_few_millionths():
    clock = NodeClock()
    stamps_of(jittery(captured(120e-6)), clock)
    assert clock.drift == pytest.approx(120e-6, abs=20e-6)


def test_a_host_clock_that_is_set_by_a_second_is_followed_within_two_seconds():
    capture_ns = captured()
    capture_ns[3000:] += 1000 * MS
    clock = NodeClock()
    error_ms = deviation_ms(stamps_of(jittery(capture_ns), clock), capture_ns)
    assert clock.counters["clock_steps"] == 1
    assert error_ms[3250:].max() < 5.0


@pytest.mark.parametrize("clock", [NodeClock(), CountingClock()], ids=["node", "counting"])
def test_a_host_clock_that_is_set_back_by_an_hour_is_followed_at_once(clock):
    arrival_ns = captured()
    arrival_ns[3000:] -= 3600 * 1000 * MS
    has_clock = isinstance(clock, NodeClock)
    stamps = [
        (clock.stamp(10_000 * k, ns) if has_clock else clock.stamp(ns)).stamp_ns
        for k, ns in enumerate(arrival_ns.tolist())
    ]
    assert deviation_ms(np.array(stamps), arrival_ns)[SETTLED:].max() < 3.0
    assert clock.counters["clock_jumps"] == 1


def test_the_time_between_samples_is_their_period_while_stamps_are_held():
    arrival_ns, clock = captured(), CountingClock()
    arrival_ns[3000:] -= 3000 * MS
    elapsed = [clock.stamp(ns).elapsed_s for ns in arrival_ns.tolist()]
    assert clock.counters["stamps_held"] > 100
    assert sum(elapsed[3000:3300]) == pytest.approx(3.0, abs=0.1)


def test_a_restarted_node_is_stamped_right_at_once():
    clock = NodeClock()
    for k in range(500):
        clock.stamp(60_000_000 + 10_000 * k, START_NS + 10 * MS * k)
    time = clock.stamp(1_000, START_NS + 7000 * MS)
    assert time.elapsed_s is None
    assert time.stamp_ns == START_NS + 7000 * MS


@pytest.mark.parametrize("link", [buffered, stalled])
@pytest.mark.parametrize("skew", [0.0, -0.004])
def test_samples_of_a_device_without_a_clock_are_stamped_by_their_count(link, skew: float):
    capture_ns, clock = captured(skew), CountingClock()
    stamps = np.array([clock.stamp(ns).stamp_ns for ns in link(capture_ns).tolist()])
    error_ms = deviation_ms(stamps, capture_ns)[SETTLED:]
    assert np.percentile(error_ms, 99) < 2.5


def test_lost_samples_of_a_device_without_a_clock_are_detected():
    capture_ns, clock = captured(), CountingClock()
    kept = np.delete(np.arange(SAMPLES), [3000, 3001, 3002])
    arrival_ns = buffered(capture_ns)[kept]
    stamps = np.array([clock.stamp(ns).stamp_ns for ns in arrival_ns.tolist()])
    error_ms = deviation_ms(stamps, capture_ns[kept])
    assert clock.counters["clock_steps"] == 1
    assert error_ms[3250:].max() < 3.0


def test_a_backlog_at_the_start_does_not_spoil_the_count():
    capture_ns, clock = captured(), CountingClock()
    arrival_ns = capture_ns.copy()
    arrival_ns[:150] = capture_ns[150]  # 1.5 s that waited in the driver
    stamps = np.array([clock.stamp(ns).stamp_ns for ns in arrival_ns.tolist()])
    assert deviation_ms(stamps, capture_ns)[1500:].max() < 3.0


def test_steps_of_time_are_positive_and_add_up():
    clock = CountingClock()
    times = [clock.stamp(ns) for ns in buffered(captured()).tolist()]
    elapsed = [time.elapsed_s for time in times]
    assert elapsed[0] is None
    assert min(elapsed[1:]) > 0.0
    assert sum(elapsed[1:]) == pytest.approx((times[-1].stamp_ns - times[0].stamp_ns) * 1e-9)
