import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from pose_io.recordings.recording import make_stream
from pose_io.recordings.timeline import CLOCKS, make_timeline, order_lines

MS = 1_000_000  # [ns]


def stream(host_ms, sensor_ms=None):
    count = len(host_ms)
    return make_stream(
        "left",
        host_time_ns=[round(t * MS) for t in host_ms],
        sensor_time_ns=None if sensor_ms is None else [round(t * MS) for t in sensor_ms],
        person=[f"{i}" for i in range(count)],
        positions=np.zeros((count, 15, 3)),
        tracking_state=np.full((count, 15), 2, dtype=np.uint8),
    )


def counts(repeated=0, out_of_order=0, reordered=0):
    return {
        "frames_repeated": repeated,
        "frames_out_of_order": out_of_order,
        "frames_reordered": reordered,
    }


def test_times_of_arrival_are_kept_for_the_host_s_clock():
    timeline = make_timeline(stream([0, 40, 66], sensor_ms=[0, 33, 66]), "host")

    assert timeline.time_ns.tolist() == [0, 40 * MS, 66 * MS]
    assert timeline.fit is None


def test_the_spacing_of_the_sensor_s_clock_is_kept():
    sensor = [33.0 * k for k in range(100)]
    host = [1000 + t + (k * 7) % 20 for k, t in enumerate(sensor)]

    timeline = make_timeline(stream(host, sensor))

    np.testing.assert_allclose(np.diff(timeline.time_ns), 33 * MS, rtol=2e-4)


def test_without_a_sensor_clock_the_host_s_is_the_only_one():
    timeline = make_timeline(stream([0, 40, 66]), "sensor")

    assert timeline.time_ns.tolist() == [0, 40 * MS, 66 * MS]
    assert timeline.fit is None


@pytest.mark.parametrize("clock", CLOCKS)
def test_a_sensor_frame_shown_on_two_ticks_counts_once(clock):
    timeline = make_timeline(stream([0, 33, 66, 100], sensor_ms=[0, 33, 33, 100]), clock)

    assert timeline.frame.tolist() == [0, 1, 3]
    assert timeline.counts == counts(repeated=1)


def test_a_late_frame_is_put_back_in_order_on_the_sensor_s_clock():
    timeline = make_timeline(stream([0, 33, 66, 100], sensor_ms=[0, 66, 33, 100]), "sensor")

    assert timeline.frame.tolist() == [0, 2, 1, 3]
    assert timeline.counts == counts(reordered=1)


def test_a_late_frame_is_left_out_on_the_host_s_clock():
    timeline = make_timeline(stream([0, 33, 66, 100], sensor_ms=[0, 66, 33, 100]), "host")

    assert timeline.frame.tolist() == [0, 1, 3]
    assert timeline.counts == counts(out_of_order=1)


def test_host_stamps_that_run_backwards_are_left_out():
    timeline = make_timeline(stream([0, 33, 20, 66, 100]))

    assert len(timeline) == 4
    assert timeline.counts == counts(out_of_order=1)
    (line,) = order_lines(stream([0, 33, 20, 66, 100]), timeline)
    assert line.startswith("sensor left: 1 of 5 frames left out: their time goes back")


def test_one_stamp_far_ahead_costs_one_frame():
    timeline = make_timeline(stream([0, 33, 999_999, 66, 100]))

    assert timeline.frame.tolist() == [0, 1, 3, 4]
    assert timeline.counts == counts(out_of_order=1)


def test_frames_go_on_after_the_sensor_s_clock_was_reset():
    sensor = [60_000 + 33 * k for k in range(50)] + [33 * k for k in range(50)]
    host = [33 * k for k in range(100)]

    timeline = make_timeline(stream(host, sensor))

    assert len(timeline) == 100
    np.testing.assert_allclose(np.diff(timeline.time_ns), 33 * MS, rtol=1e-3)


def test_gaps_are_found():
    timeline = make_timeline(stream([0, 33, 12_033, 12_066]))

    assert timeline.gaps(longer_than_s=0.5) == [(33 * MS, 12.0)]


stamps = st.lists(st.integers(min_value=-20_000, max_value=20_000), min_size=1, max_size=30)


@settings(max_examples=60, deadline=None, derandomize=True)
@given(host=stamps, sensor=stamps, clock=st.sampled_from(CLOCKS), own=st.booleans())
def test_whatever_the_stamps_time_increases_and_every_frame_is_accounted_for(
    host, sensor, clock, own
):
    length = min(len(host), len(sensor))
    seen = stream(host[:length], sensor[:length] if own else None)

    timeline = make_timeline(seen, clock)

    assert (np.diff(timeline.time_ns) > 0).all()
    left_out = timeline.counts["frames_repeated"] + timeline.counts["frames_out_of_order"]
    assert len(timeline) + left_out == len(seen)
    assert len(timeline) >= 1
