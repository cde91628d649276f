"""A recording's samples come in the order of their corrected stamps, and none is lost."""

import numpy as np
import pytest

from pose_core.joints import JOINTS
from pose_core.streams.clocks import IMUS, Clock
from pose_core.streams.recording_order import RecordingOrder, in_order
from pose_core.streams.samples import ImuBlock, ImuSample, SkeletonSample

MS = 1_000_000
BEGIN_NS = 10**18


def skeleton(sensor, at_ms):
    return SkeletonSample(
        stamp_ns=BEGIN_NS + at_ms * MS,
        sensor=sensor,
        person="1",
        positions=np.zeros((len(JOINTS), 3)),
        tracking_state=np.full(len(JOINTS), 2, np.uint8),
    )


def imu(segment, at_ms):
    return ImuSample(
        stamp_ns=BEGIN_NS + at_ms * MS,
        segment=segment,
        orientation=np.array([0.0, 0.0, 0.0, 1.0]),
        orientation_stddev=np.zeros(3),
        angular_velocity=np.zeros(3),
    )


def recorded(until_ms, *, left_ahead=0, imu_ahead=0, one_ahead=0):
    """Samples in the order of recording, with what each clock is ahead [ms]."""
    found = []
    for at in range(0, until_ms, 10):
        found.append((at, imu("torso", at + imu_ahead)))
        found.append((at, imu("left_shank", at + imu_ahead + one_ahead)))
        if at % 30 == 0:
            found.append((at + 40, skeleton("left", at + left_ahead)))
            found.append((at + 70, skeleton("right", at + 15)))
    return [sample for _, sample in sorted(found, key=lambda each: each[0])]


def instants(samples, clocks):
    """Every sample's corrected stamp [ms], in the order given."""
    found = []
    for each in samples:
        if isinstance(each, ImuBlock):
            clock = clocks.get(IMUS, Clock())
            found += [clock.to_reference(stamp) for stamp in each.stamps_ns.tolist()]
        else:
            found.append(clocks.get(each.sensor, Clock()).to_reference(each.stamp_ns))
    return (np.array(found) - BEGIN_NS) / MS


@pytest.mark.parametrize(("left_ahead", "imu_ahead"), [(0, 0), (-210, 370), (400, -400)])
def test_samples_come_in_the_order_of_their_corrected_stamps(left_ahead, imu_ahead):
    samples = recorded(30_000, left_ahead=left_ahead, imu_ahead=imu_ahead)
    clocks = {"left": Clock(offset_ns=left_ahead * MS), IMUS: Clock(offset_ns=imu_ahead * MS)}
    found = instants(in_order(samples, clocks), clocks)
    assert len(found) == len(samples)
    assert np.all(np.diff(found) >= 0.0)


def test_one_imu_that_is_ahead_delays_no_other_sample():
    samples = recorded(5_000, one_ahead=250)
    found = instants(in_order(samples, {}), {})
    assert len(found) == len(samples)
    assert np.all(np.diff(found) >= 0.0)


def test_samples_that_are_far_ahead_are_counted_and_left_out():
    order = RecordingOrder({})
    samples = recorded(5_000, one_ahead=3_600_000)
    places = range(len(samples))
    frames = [
        (p, [s]) for p, s in zip(places, samples, strict=True) if isinstance(s, SkeletonSample)
    ]
    list(order.add(frames, *rows_of(samples)))
    list(order.flush())
    (line,) = order.left_out
    assert line.startswith("IMU left_shank: 500 samples left out")


def rows_of(samples):
    """The IMU samples as one block, with their places."""
    chosen = [(p, s) for p, s in enumerate(samples) if isinstance(s, ImuSample)]
    segments = ("torso", "left_shank")
    block = ImuBlock(
        segments=segments,
        imu=np.array([segments.index(s.segment) for _, s in chosen]),
        stamps_ns=np.array([s.stamp_ns for _, s in chosen]),
        orientation=np.array([s.orientation for _, s in chosen]),
        orientation_stddev=np.array([s.orientation_stddev for _, s in chosen]),
        angular_velocity=np.array([s.angular_velocity for _, s in chosen]),
        linear_acceleration=np.array([s.linear_acceleration for _, s in chosen]),
    )
    return block, np.array([p for p, _ in chosen])


def test_a_recording_that_begins_anew_is_not_mixed_with_what_came_before():
    once = recorded(3_000)
    found = instants(in_order([*once, *once], {}), {})
    assert len(found) == 2 * len(once)
    assert np.sum(np.diff(found) < 0.0) == 1


def test_imus_alone_come_through():
    samples = [imu("torso", at) for at in range(0, 20_000, 10)]
    found = instants(in_order(samples, {}), {})
    assert len(found) == len(samples)


def test_an_imu_that_ends_while_the_cameras_are_silent_costs_no_other_s_samples():
    both = [imu(name, at) for at in range(0, 1_000, 10) for name in ("torso", "left_shank")]
    samples = [*both, *(imu("torso", at) for at in range(1_000, 15_000, 10))]
    assert len(instants(in_order(samples, {}), {})) == len(samples)


def test_samples_left_out_are_warned_of():
    with pytest.warns(UserWarning, match="IMU left_shank: 100 samples left out"):
        list(in_order(recorded(1_000, one_ahead=3_600_000), {}))
