from pathlib import Path

import numpy as np
import pytest

from kinect_bridge.replay import Replay
from pose_core.errors import InputError
from pose_io.recordings.formats import read_recording
from pose_io.recordings.recording import make_recording, make_stream
from pose_io.recordings.timeline import make_timeline

CSV = Path(__file__).parents[2] / "kinect_bridge" / "data" / "two_sensors.csv"
START = 1_763_697_600_000_000_000  # [ns]
MS = 1_000_000  # [ns]


def replayed(sensor="left", recording=None, **options):
    recording = recording or read_recording(CSV)
    timelines = [make_timeline(stream) for stream in recording.streams]
    return Replay(recording, timelines, sensor, start_at_ns=START, **options)


def stamps(plan, count):
    return [plan.due_ns(i) for i in range(count)]


def test_stamps_keep_the_recording_s_timing_between_sensors():
    left, right = replayed("left"), replayed("right")

    assert left.due_ns(0) == START
    assert right.due_ns(0) == pytest.approx(START + 40 * MS, abs=1000)
    assert right.due_ns(5) - left.due_ns(5) == pytest.approx(40 * MS, abs=1000)


def test_a_higher_rate_shortens_all_spacing():
    plain, fast = replayed(rate=1.0), replayed(rate=20.0)

    for i in range(6):
        assert (fast.due_ns(i) - START) * 20 == pytest.approx(plain.due_ns(i) - START, abs=20)


def test_a_replay_ends_after_the_last_frame():
    plan = replayed()

    assert plan.due_ns(5) is not None
    assert plan.due_ns(6) is None


def test_both_sensors_loop_with_one_period():
    left, right = replayed("left", loop=True), replayed("right", loop=True)

    periods = {plan.due_ns(k + 6) - plan.due_ns(k) for plan in (left, right) for k in range(20)}

    # 0.54 s from the first frame of the one to the last of the other, and one interval.
    assert len(periods) == 1
    assert periods.pop() == pytest.approx(640 * MS, abs=1000)


@pytest.mark.parametrize("rate", [0.5, 1.0, 20.0, 1000.0])
def test_looping_stamps_keep_increasing(rate):
    assert (np.diff(stamps(replayed(loop=True, rate=rate), 100)) > 0).all()


def test_time_zero_of_the_recording_is_due_at_the_start():
    recording = read_recording(CSV)
    later = make_recording(
        "x", "csv", recording.streams, time_zero_ns=recording.time_zero_ns - 70 * MS
    )

    assert replayed(recording=later).due_ns(0) == START + 70 * MS


def test_no_frame_is_taken_before_it_is_due():
    replay = replayed()

    assert replay.take(START - 1) is None
    assert replay.wait_ns(START - 5 * MS) >= 5 * MS
    assert replay.take(START) == (0, START)


def test_a_long_wait_is_limited_so_that_clock_steps_are_detected():
    assert replayed().wait_ns(START - 3_600_000 * MS) == 1_000 * MS


def test_each_frame_is_taken_once_and_in_order():
    replay = replayed()
    now, frames = START, []

    while not replay.finished:
        due = replay.take(now)
        if due is not None:
            frames.append(due[0])
        now += replay.wait_ns(now) or 0

    assert frames == [0, 1, 2, 3, 4, 5]
    assert replay.wait_ns(now) is None
    assert replay.take(now + 10**12) is None


def test_a_late_replay_loses_no_frame_and_causes_no_burst():
    replay = replayed()
    now, taken = START + 10_000 * MS, []

    while not replay.finished:
        taken.append((now, replay.take(now)))
        now += replay.wait_ns(now) or 0

    assert [stamp_ns for _, (_, stamp_ns) in taken] == stamps(replay, 6)
    spacing = np.diff([moment for moment, _ in taken])
    assert (spacing > 24 * MS).all()  # a quarter of the 100 ms between frames


def test_progress_goes_from_zero_to_one():
    replay = replayed()
    seen = [replay.progress]
    for i in range(6):
        replay.take(START + i * 1_000 * MS)
        seen.append(replay.progress)

    np.testing.assert_allclose(seen, np.arange(7) / 6)


def test_progress_begins_anew_in_every_round():
    replay = replayed(loop=True)

    replay.played = 6
    assert replay.progress == 1.0
    replay.played = 7
    assert replay.progress == pytest.approx(1 / 6)


def test_one_frame_alone_can_loop():
    stream = make_stream(
        "left",
        host_time_ns=[5],
        sensor_time_ns=None,
        person=[""],
        positions=np.zeros((1, 15, 3)),
        tracking_state=np.zeros((1, 15), dtype=np.uint8),
    )
    plan = replayed(recording=make_recording("x", "csv", [stream]), loop=True)

    assert (np.diff(stamps(plan, 5)) > 0).all()


def test_a_sensor_that_is_not_there_is_refused():
    with pytest.raises(InputError, match="sensor '2' was asked for"):
        replayed("2")
