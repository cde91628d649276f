"""Stamps of live frames."""

import numpy as np
import pytest

from kinect_bridge.sources.live_clock import CLOCK_COUNTERS, LiveClock
from pose_core.counters import Counters

MS, S = 10**6, 10**9  # [ns]
NOW = 1_700_000_000 * S


def clock(*, on_host_clock: bool) -> tuple[LiveClock, Counters]:
    counters = Counters(*CLOCK_COUNTERS)
    return LiveClock(counters, on_host_clock=on_host_clock), counters


def counted(counters: Counters) -> dict[str, int]:
    return {name: count for name, count in counters.as_dict().items() if count}


def test_a_stamp_of_the_host_s_clock_is_taken_as_it_is():
    live, counters = clock(on_host_clock=True)

    assert live.stamp(NOW - 80 * MS, NOW) == NOW - 80 * MS
    assert live.delay_ns == 80 * MS
    assert counted(counters) == {}


@pytest.mark.parametrize("offset_ns", [3600 * S, S, -6 * S, -3600 * S])
def test_a_stamp_of_another_host_s_clock_is_mapped(offset_ns):
    live, counters = clock(on_host_clock=True)

    assert live.stamp(NOW + offset_ns, NOW) == NOW
    assert counted(counters) == {"stamps_mapped": 1}


def test_jitter_of_transport_does_not_reach_the_stamps_of_a_device():
    live, _ = clock(on_host_clock=False)
    rng = np.random.default_rng(4)
    captures = np.arange(600) * 33 * MS
    arrivals = NOW + captures + rng.exponential(5 * MS, 600).astype(np.int64)

    stamps = [live.stamp(int(c), int(a)) for c, a in zip(captures, arrivals, strict=True)]

    steps = np.diff(stamps[150:]) / MS
    assert np.std(steps) < 0.2
    assert np.mean(steps) == pytest.approx(33.0, abs=0.01)


def test_a_message_without_a_stamp_is_stamped_by_its_arrival_less_the_usual_delay():
    live, counters = clock(on_host_clock=True)
    live.stamp(NOW - 80 * MS, NOW)

    assert live.stamp(None, NOW + 100 * MS) == NOW + 20 * MS
    assert counted(counters) == {"stamps_missing": 1}


def test_repeated_and_earlier_frames_are_left_out():
    live, counters = clock(on_host_clock=False)
    live.stamp(100 * MS, NOW)

    assert live.stamp(100 * MS, NOW + MS) is None
    assert live.stamp(67 * MS, NOW + 2 * MS) is None
    assert counters["frames_repeated"] == 1
    assert counters["frames_out_of_order"] == 1


def test_a_device_that_begins_anew_is_followed():
    live, counters = clock(on_host_clock=False)
    before = live.stamp(1000 * S, NOW)

    after = live.stamp(0, NOW + 33 * MS)

    assert after == NOW + 33 * MS > before
    assert counters["clock_jumps"] == 1


def test_a_host_clock_that_is_set_back_does_not_hold_the_stamps_for_good():
    live, counters = clock(on_host_clock=True)
    live.stamp(NOW, NOW)

    assert live.stamp(NOW - 3600 * S, NOW - 3600 * S) == NOW - 3600 * S
    assert counted(counters) == {"clock_jumps": 1}


def test_stamps_increase_strictly_whatever_comes():
    live, _ = clock(on_host_clock=True)
    rng = np.random.default_rng(5)
    stamps = []
    for i in range(500):
        arrival = NOW + i * 33 * MS
        capture = None if rng.random() < 0.2 else int(arrival - rng.integers(0, 200 * MS))
        stamp = live.stamp(capture, arrival)
        stamps += [] if stamp is None else [stamp]

    assert (np.diff(stamps) > 0).all()
    assert len(stamps) > 250
