"""What holds for time alignment, however the samples arrive."""

import numpy as np
import pytest

from pose_core.joints import JOINTS
from pose_core.streams.samples import SkeletonSample
from pose_core.streams.time_alignment import TimeAligner

MS = 1_000_000
NAMES = ("a", "b", "c")
MIN_FRAMES = 20  # [-] of two seconds, or nothing has been compared


def stream(rng, sensor, *, drop=0.0, silences=()):
    """Two seconds at about 30 Hz, at a phase of its own."""
    stamps = rng.uniform(0, 33) + np.arange(60) * 33.3 + rng.normal(0, 1.0, 60)
    stamps = stamps[rng.random(60) >= drop]
    for begin, end in silences:
        stamps = stamps[(stamps < begin) | (stamps > end)]
    return [
        SkeletonSample(
            stamp_ns=int(stamp * MS),
            sensor=sensor,
            person="1",
            positions=rng.normal(size=(len(JOINTS), 3)),
            tracking_state=rng.integers(0, 3, len(JOINTS)).astype(np.uint8),
        )
        for stamp in stamps
    ]


def interleave(rng, streams, jitter_ms):
    """Each sample arrives up to a jitter after its capture, in its sensor's order."""
    arrivals = []
    for samples in streams:
        stamps = np.array([sample.stamp_ns for sample in samples])
        times = np.maximum.accumulate(stamps + rng.uniform(0, jitter_ms * MS, len(samples)))
        arrivals += list(zip(times, samples, strict=True))
    return [sample for _, sample in sorted(arrivals, key=lambda arrival: arrival[0])]


def align(samples, names):
    aligner = TimeAligner(names)
    frames = [frame for sample in samples for frame in aligner.add(sample)]
    return frames + aligner.flush(), aligner


def as_bytes(frames):
    return [
        (
            frame.stamp_ns,
            [
                (name, one.stamp_ns, one.positions.tobytes(), one.tracking_state.tobytes())
                for name, one in sorted(frame.samples.items())
            ],
        )
        for frame in frames
    ]


@pytest.mark.parametrize("count", [2, 3])
@pytest.mark.parametrize("drop", [0.0, 0.2])
def test_interleaving_does_not_change_the_frames(count, drop):
    for seed in range(20):
        rng = np.random.default_rng(seed)
        streams = [stream(rng, name, drop=drop) for name in NAMES[:count]]
        reference = as_bytes(align(interleave(rng, streams, 0.0), NAMES[:count])[0])
        assert len(reference) > MIN_FRAMES
        for _ in range(3):
            frames = align(interleave(rng, streams, 19.0), NAMES[:count])[0]
            assert as_bytes(frames) == reference


def test_interleaving_does_not_change_the_frames_when_sensors_fall_silent_and_return():
    for seed in range(40):
        rng = np.random.default_rng(seed)
        begin, length = rng.uniform(0, 1500), rng.uniform(100, 800)
        streams = [
            stream(rng, "a", drop=0.1, silences=[(900, 1100)]),
            stream(rng, "b", drop=0.1, silences=[(begin, begin + length)]),
        ]
        reference = as_bytes(align(interleave(rng, streams, 0.0), NAMES[:2])[0])
        assert len(reference) > MIN_FRAMES
        for _ in range(3):
            frames = align(interleave(rng, streams, 19.0), NAMES[:2])[0]
            assert as_bytes(frames) == reference


def test_alignment_of_steady_streams_tolerates_large_jitter():
    for seed in range(20):
        rng = np.random.default_rng(seed)
        streams = [stream(rng, name) for name in NAMES[:2]]
        reference = as_bytes(align(interleave(rng, streams, 0.0), NAMES[:2])[0])
        assert len(reference) > MIN_FRAMES
        assert as_bytes(align(interleave(rng, streams, 100.0), NAMES[:2])[0]) == reference


def test_stamps_of_frames_strictly_increase_in_any_interleaving():
    for seed in range(30):
        rng = np.random.default_rng(seed)
        streams = [stream(rng, name, drop=0.3, silences=[(500, 900)]) for name in NAMES]
        frames, _ = align(interleave(rng, streams, 400.0), NAMES)
        stamps = [frame.stamp_ns for frame in frames]
        assert len(stamps) > MIN_FRAMES
        assert (np.diff(stamps) > 0).all()


def test_the_order_of_the_sensors_names_is_irrelevant():
    rng = np.random.default_rng(1)
    samples = interleave(rng, [stream(rng, name, drop=0.1) for name in NAMES], 10.0)
    assert as_bytes(align(samples, NAMES)[0]) == as_bytes(align(samples, NAMES[::-1])[0])


def test_every_sample_of_steady_streams_is_used_in_a_frame():
    rng = np.random.default_rng(2)
    streams = [stream(rng, name) for name in NAMES[:2]]
    frames, aligner = align(interleave(rng, streams, 5.0), NAMES[:2])
    assert len(frames) <= 62
    assert sum(len(frame.samples) for frame in frames) >= 118
    assert aligner.counters["received"] == 120


def test_interpolation_is_exact_on_uniform_motion():
    rng = np.random.default_rng(3)
    start, velocity = rng.normal(size=(2, len(JOINTS), 3))

    def moving(one):
        positions = start + velocity * one.stamp_ns * 1e-9
        return SkeletonSample(
            stamp_ns=one.stamp_ns,
            sensor=one.sensor,
            person="1",
            positions=positions,
            tracking_state=np.full(len(JOINTS), 2, dtype=np.uint8),
        )

    streams = [[moving(one) for one in stream(rng, name, drop=0.1)] for name in NAMES]
    for frame in align(interleave(rng, streams, 5.0), NAMES)[0]:
        for one in frame.samples.values():
            expected = start + velocity * frame.stamp_ns * 1e-9
            np.testing.assert_allclose(one.positions, expected, atol=1e-9)
