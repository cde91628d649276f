from collections import Counter

import numpy as np
import pytest

from pose_core.streams.frame_order import GIVEN_UP_NS, FrameOrder

MS = 1_000_000
PERIOD_NS = 33_333_333


def frames(sensor, phase_ns, count=60, jitter_ns=0, rng=None):
    """Stamps of one sensor."""
    noise = rng.normal(0.0, jitter_ns, count) if rng is not None else np.zeros(count)
    return [(sensor, 10**18 + k * PERIOD_NS + phase_ns + round(noise[k])) for k in range(count)]


def told(order, arrivals):
    """The stamps that come out of each arrival."""
    return [[stamp for _, stamp in order.add(*each, each)] for each in arrivals]


def in_turns(one, other, rng):
    """Both sensors' frames, each pair in either order."""
    pairs = [rng.permutation(2) for _ in one]
    return [
        (first, second)[i] for p, first, second in zip(pairs, one, other, strict=True) for i in p
    ]


@pytest.mark.parametrize("phase_ns", [-400_000, 0, 300_000, 900_000])
def test_frames_of_synchronous_sensors_are_sorted_by_stamp(phase_ns):
    rng = np.random.default_rng(1)
    arrivals = in_turns(
        frames("left", 0, jitter_ns=100_000, rng=rng),
        frames("right", phase_ns, jitter_ns=100_000, rng=rng),
        rng,
    )
    order = FrameOrder()
    out = [stamp for each in told(order, arrivals) for stamp in each] + [
        stamp for _, stamp in order.flush()
    ]
    assert Counter(out) == Counter(stamp for _, stamp in arrivals)
    learnt = out[6:]  # nobody knows a sensor's rhythm from its first frames
    assert learnt == sorted(learnt)


def test_a_frame_waits_only_for_the_other_frame_of_its_instant():
    rng = np.random.default_rng(2)
    arrivals = in_turns(frames("left", 0), frames("right", 200_000), rng)
    order = FrameOrder()
    for index, stamps in enumerate(told(order, arrivals)):
        if index % 2:
            assert not order.holds
            assert stamps


def test_frames_of_sensors_in_opposite_phase_do_not_wait():
    arrivals = sorted(frames("left", 0) + frames("right", 15 * MS), key=lambda each: each[1])
    order = FrameOrder()
    assert all(len(each) == 1 for each in told(order, arrivals))


def test_a_missing_frame_delays_the_others_until_the_next_frame():
    left, right = frames("left", 0, 12), frames("right", 100_000, 12)
    order = FrameOrder()
    told(order, [each for pair in zip(left[:10], right[:10], strict=True) for each in pair])
    assert told(order, [left[10]]) == [[]]
    assert told(order, [left[11]]) == [[left[10][1]]]
    assert told(order, [right[11]]) == [[left[11][1], right[11][1]]]


def test_frames_do_not_wait_for_a_silent_sensor():
    left, right = frames("left", 0, 40), frames("right", 100_000, 10)
    order = FrameOrder()
    told(order, [each for pair in zip(left[:10], right, strict=True) for each in pair])
    gone = 11 + GIVEN_UP_NS // PERIOD_NS
    told(order, left[10 : gone + 1])
    assert told(order, left[gone + 1 :])[1:] == [[stamp] for _, stamp in left[gone + 2 :]]


def test_a_late_frame_is_returned_at_once():
    left, right = frames("left", 0, 12), frames("right", 100_000, 11)
    order = FrameOrder()
    told(order, [each for pair in zip(left[:10], right[:10], strict=True) for each in pair])
    told(order, left[10:])
    order.flush()
    assert told(order, [right[10]]) == [[right[10][1]]]


def test_ordering_restarts_when_a_recording_loops():
    order = FrameOrder()
    stamps = [10**18 + k * PERIOD_NS for k in range(60)]
    told(order, [("left", stamp) for stamp in stamps])
    assert told(order, [("left", stamp) for stamp in stamps[:3]]) == [[s] for s in stamps[:3]]


def late_right(count=60, late_ns=80 * MS):
    """Arrivals of two sensors, one of which is behind in its stamps."""
    left, right = frames("left", 0, count), frames("right", 7 * MS - late_ns, count)
    return [each for pair in zip(left, right, strict=True) for each in pair]


def test_a_recordings_frames_wait_for_a_sensor_whose_stamps_are_far_behind():
    order = FrameOrder(is_live=False)
    out = [stamp for each in told(order, late_right()) for stamp in each]
    out += [stamp for _, stamp in order.flush()]
    assert len(out) == 120
    assert out[6:] == sorted(out[6:])


def test_a_recordings_frames_do_not_wait_for_a_sensor_that_has_ended():
    order = FrameOrder(is_live=False)
    told(order, late_right(20))
    left = frames("left", 0, 60)[20:]
    out = told(order, left)
    assert sum(map(len, out[: 1 + GIVEN_UP_NS // PERIOD_NS])) >= 8
    assert all(len(each) == 1 for each in out[2 + GIVEN_UP_NS // PERIOD_NS :])


def test_live_frames_wait_for_one_period_at_most():
    order = FrameOrder()
    waits = [len(each) for each in told(order, late_right())]
    assert max(waits) <= 2
    assert sum(waits) >= 118


def test_a_frame_of_no_sensor_waits_too_and_none_waits_for_it():
    order, arrivals = FrameOrder(is_live=False), frames("right", 0, 22)
    told(order, arrivals[:20])
    assert order.insert(arrivals[20][1] + MS, "between") == []
    assert order.add(*arrivals[20], "before") == ["before", "between"]
    assert order.add(*arrivals[21], "after") == ["after"]


def test_slow_cameras_of_a_recording_are_waited_for_too():
    period_ns = 100 * MS
    stamps = [10**18 + k * period_ns for k in range(60)]
    arrivals = [each for t in stamps for each in (("left", t), ("right", t - 150 * MS))]
    order = FrameOrder(is_live=False)
    out = [stamp for each in told(order, arrivals) for stamp in each]
    assert out[6:] == sorted(out[6:])


def test_a_looped_recording_is_in_order_again_after_a_frame_of_its_end():
    order = FrameOrder(is_live=False)
    told(order, late_right())
    again = late_right()
    order.add(*again[0], again[0])
    order.insert(again[-1][1], "straggler")
    out = [each for arrival in again[1:] for each in order.add(*arrival, arrival)]
    stamps = [each[1] for each in out if each != "straggler"]
    assert stamps[6:] == sorted(stamps[6:])
