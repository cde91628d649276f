"""Time alignment of skeleton streams."""

import numpy as np
import pytest

from pose_core.errors import ParameterError
from pose_core.joints import JOINT_INDEX, JOINTS, TrackingState
from pose_core.streams.samples import SkeletonSample
from pose_core.streams.time_alignment import TimeAligner

MS = 1_000_000


def sample(sensor, stamp_ms, value=None, state=TrackingState.TRACKED):
    """All joints at (value, 0, 0); by default the value is the stamp in ms."""
    positions = np.zeros((len(JOINTS), 3))
    positions[:, 0] = stamp_ms if value is None else value
    return SkeletonSample(
        stamp_ns=round(stamp_ms * MS),
        sensor=sensor,
        person="1",
        positions=positions,
        tracking_state=np.full(len(JOINTS), state, dtype=np.uint8),
    )


def feed(aligner, *samples):
    return [frame for one in samples for frame in aligner.add(one)]


def stamps_ms(frames):
    return [frame.stamp_ns / MS for frame in frames]


def sensors(frames):
    return ["".join(sorted(frame.samples)) for frame in frames]


def values(frames, sensor):
    return [frame.samples[sensor].positions[0, 0] for frame in frames if sensor in frame.samples]


def test_pairs_are_interpolated_back_to_the_earlier_stamp():
    aligner = TimeAligner(["a", "b"])
    frames = feed(
        aligner,
        *(sample("a", 0), sample("b", 10)),
        *(sample("a", 33), sample("b", 43)),
        *(sample("a", 66), sample("b", 76)),
    )
    assert stamps_ms(frames) == [0, 33, 66]
    assert sensors(frames) == ["a", "ab", "ab"]
    assert values(frames, "a") == [0, 33, 66]
    assert values(frames, "b") == pytest.approx([33, 66])
    assert all(one.stamp_ns == f.stamp_ns for f in frames for one in f.samples.values())


def test_the_second_sensor_may_be_the_earlier_one_of_a_pair():
    aligner = TimeAligner(["a", "b"])
    frames = feed(
        aligner, sample("a", 10), sample("b", 0), sample("a", 43), sample("b", 33), sample("a", 76)
    )
    assert stamps_ms(frames) == [0, 33]
    assert values(frames, "a") == pytest.approx([33])


def test_equal_stamps_give_both_samples_as_they_are():
    aligner = TimeAligner(["a", "b"])
    a, b = sample("a", 5), sample("b", 5)
    (frame,) = feed(aligner, a, b)
    assert frame.samples == {"a": a, "b": b}


def test_a_single_sensor_passes_without_delay():
    aligner = TimeAligner(["a"])
    for stamp in (0, 33, 500, 533):
        one = sample("a", stamp)
        (frame,) = aligner.add(one)
        assert frame.samples["a"] is one


def test_a_dropped_frame_does_not_shift_the_pairing_that_follows():
    aligner = TimeAligner(["a", "b"])
    for k in range(10):
        frames = feed(aligner, sample("a", 33 * k), *([sample("b", 33 * k + 5)] if k != 4 else []))
        if k > 5:
            assert stamps_ms(frames) == [33 * k]
            assert values(frames, "b") == pytest.approx([33 * k])


def test_a_short_gap_is_interpolated_across():
    aligner = TimeAligner(["a", "b"])
    feed(aligner, sample("a", 0), sample("b", 5))
    frames = feed(aligner, sample("a", 33), sample("a", 66), sample("b", 71))
    assert values(frames, "b") == pytest.approx([33, 66])


def test_a_sensor_is_absent_in_a_gap_too_long_to_interpolate():
    aligner = TimeAligner(["a", "b"], max_gap_s=0.1)
    feed(aligner, sample("a", 0), sample("b", 5))
    frames = feed(aligner, *(sample("a", t) for t in (33, 66, 99)), sample("b", 106))
    assert sensors(frames) == ["a", "a", "a"]
    assert aligner.counters["incomplete_frames"] == 4


def test_a_slow_sensor_is_interpolated_between_its_frames():
    aligner = TimeAligner(["a", "b"])  # up to 0.1 s
    slow = [sample("b", t) for t in range(0, 3000, 175)]
    fast = [sample("a", t) for t in range(0, 3000, 33)]
    frames = feed(aligner, *sorted([*slow, *fast], key=lambda one: one.stamp_ns))
    assert sensors(frames)[-20:] == ["ab"] * 20


def test_frames_wait_for_a_silent_sensor_at_most_max_wait():
    aligner = TimeAligner(["a", "b"], max_wait_s=0.2)
    feed(aligner, sample("a", 0), sample("b", 0))
    assert feed(aligner, *(sample("a", t) for t in (33, 66, 99, 132, 165, 198, 231))) == []
    assert stamps_ms(aligner.add(sample("a", 264))) == [33, 66, 99, 132, 165, 198, 231, 264]
    assert stamps_ms(aligner.add(sample("a", 297))) == [297]


def test_frames_wait_for_a_sensor_without_samples_at_most_max_wait():
    aligner = TimeAligner(["a", "b"], max_wait_s=0.2)
    frames = feed(aligner, *(sample("a", t) for t in range(0, 300, 33)))
    assert sensors(frames) == ["a"] * 10


def test_a_returning_sensor_is_aligned_again():
    aligner = TimeAligner(["a", "b"])
    feed(aligner, sample("a", 0), sample("b", 0))
    feed(aligner, *(sample("a", t) for t in range(33, 1000, 33)))
    frames = feed(aligner, sample("b", 1000), sample("a", 1023), sample("b", 1033))
    assert stamps_ms(frames) == [1023]
    assert values(frames, "b") == pytest.approx([1023])
    assert aligner.counters["returned"] == 1


def test_alignment_resumes_for_all_sensors_after_a_common_pause():
    aligner = TimeAligner(["a", "b"])
    feed(aligner, sample("a", 0), sample("b", 5))
    frames = feed(
        aligner,
        *(sample("a", 12_000), sample("b", 12_005)),
        *(sample("a", 12_033), sample("b", 12_038)),
    )
    assert stamps_ms(frames) == [12_033]
    assert sensors(frames) == ["ab"]


def test_samples_before_a_pause_are_emitted_when_it_ends():
    aligner = TimeAligner(["a", "b"])
    feed(aligner, sample("a", 0), sample("b", 0), sample("b", 33))
    frames = feed(aligner, sample("b", 5000), sample("a", 5000))
    assert stamps_ms(frames) == [33]


def test_repeated_and_backward_stamps_are_rejected_and_counted():
    aligner = TimeAligner(["a"])
    frames = feed(aligner, sample("a", 0), sample("a", 33), sample("a", 33), sample("a", 20))
    assert stamps_ms(frames) == [0, 33]
    assert aligner.counters["repeated_stamp"] == 1
    assert aligner.counters["backward_stamp"] == 1


def test_alignment_restarts_when_a_recording_loops():
    aligner = TimeAligner(["a", "b"])
    feed(aligner, *(sample(s, t) for t in (5000, 5033) for s in "ab"))
    frames = feed(aligner, *(sample(s, t) for t in (0, 33) for s in "ab"))
    assert stamps_ms(frames) == [0, 33]
    assert sensors(frames) == ["ab", "ab"]
    assert aligner.counters["clock_jumped_back"] >= 1


def test_flush_returns_the_remaining_frames():
    aligner = TimeAligner(["a", "b"])
    assert aligner.add(sample("a", 0)) == []
    assert stamps_ms(aligner.flush()) == [0]
    assert aligner.flush() == []


def test_an_interpolated_joint_has_the_worse_tracking_state_of_its_ends():
    aligner = TimeAligner(["a", "b"])
    frames = feed(
        aligner,
        *(sample("a", 0), sample("b", 5, state=TrackingState.INFERRED)),
        *(sample("a", 33), sample("b", 38)),
    )
    assert (frames[-1].samples["b"].tracking_state == TrackingState.INFERRED).all()


def test_a_joint_missing_in_one_sample_is_not_tracked():
    aligner = TimeAligner(["a", "b"])
    before, after = sample("b", 5), sample("b", 38)
    knee, hand = JOINT_INDEX["left_knee"], JOINT_INDEX["left_hand"]
    before.positions[knee] = np.nan
    after.tracking_state[hand] = TrackingState.NOT_TRACKED
    frames = feed(aligner, sample("a", 0), before, sample("a", 33), after)
    b = frames[-1].samples["b"]
    assert np.isnan(b.positions[[knee, hand]]).all()
    assert (b.tracking_state[[knee, hand]] == TrackingState.NOT_TRACKED).all()
    assert np.isfinite(b.positions).all(axis=1).sum() == len(JOINTS) - 2


def test_with_one_sensor_of_twice_the_rate_every_frame_has_both_sensors():
    aligner = TimeAligner(["a", "b"])
    feed(aligner, sample("a", 0), sample("b", 0))
    frames = feed(
        aligner, sample("b", 16), sample("a", 33), sample("b", 32), sample("b", 48), sample("a", 66)
    )
    assert sensors(frames) == ["ab"] * len(frames)
    assert stamps_ms(frames) == [16, 32, 48]


def test_buffers_stay_bounded_while_one_sensor_is_silent():
    aligner = TimeAligner(["a", "b"])
    for k in range(2000):
        aligner.add(sample("a", 33 * k))
    assert len(aligner._streams["a"].samples) < 20


def test_buffers_stay_bounded_with_a_sensor_of_too_low_a_rate():
    aligner = TimeAligner(["a", "b"])
    for k in range(300):
        aligner.add(sample("a", 500 * k))
    assert len(aligner._streams["a"].samples) < 20
    assert aligner.counters["returned"] == 299


def test_contradictory_limits_are_refused_with_their_values():
    with pytest.raises(ParameterError, match=r"max_gap = 0\.5 s"):
        TimeAligner(["a", "b"], max_gap_s=0.5, max_wait_s=0.2)


def test_a_sensor_named_twice_is_refused():
    with pytest.raises(ParameterError, match="different names"):
        TimeAligner(["a", "a"])


def test_a_sample_of_an_unknown_sensor_is_an_error():
    with pytest.raises(ValueError, match="not one of"):
        TimeAligner(["a"]).add(sample("c", 0))
