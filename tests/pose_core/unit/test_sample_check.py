"""``fuse``: samples that cannot give a pose are refused with the reason."""

from dataclasses import replace

import numpy as np
import pytest
from moving_body import motion

from pose_core.api import Extrinsics, PipelineParameters, SkeletonSample, fuse
from pose_core.errors import InputError
from pose_core.fusion.sample_check import check_samples
from pose_core.streams.clocks import Clock

PLACED = Extrinsics(
    reference="left", T_reference_sensor={"left": np.eye(4)}, T_map_reference=np.eye(4)
)


def samples(**changes):
    """Three seconds of one camera; changed fields are functions of the sample."""
    series = motion(rate=30.0, duration_s=3.0)
    made = [
        SkeletonSample(
            stamp_ns=10**18 + int(stamp_ns),
            sensor="left",
            person="1",
            positions=positions + [0.0, 0.0, 2.0],
            tracking_state=np.full(15, 2, np.uint8),
        )
        for stamp_ns, positions in zip(series.stamps_ns, series.positions, strict=True)
    ]
    return [replace(s, **{name: of(s) for name, of in changes.items()}) for s in made]


SWAPPED = [*samples()[60:], *samples()[:60]]
WRONG = {
    "mm": (samples(positions=lambda s: 1000.0 * s.positions), "give positions in metres"),
    "14 joints": (
        samples(positions=lambda s: s.positions[:14]),
        r"samples\[0\].positions has the shape \(14, 3\): expected an array of shape \(15, 3\)",
    ),
    "states": (samples(tracking_state=lambda s: s.tracking_state[:14]), r"tracking_state has the"),
    "name": (samples(sensor=lambda _: "cam1"), "are of sensor cam1, the extrinsics have left"),
    "float": (samples(stamp_ns=lambda s: s.stamp_ns * 1e-9), "type float64: expected an integer"),
    "seconds": (samples(stamp_ns=lambda s: s.stamp_ns // 10**9), "give stamp_ns in nanoseconds"),
    "ms": (samples(stamp_ns=lambda s: s.stamp_ns // 10**6), "give stamp_ns in nanoseconds"),
    "order": (SWAPPED, r"stamped 2.97 s before an earlier one: sort the samples by stamp_ns"),
    "type": ([{"a": 1}], r"samples\[0\] is a dict: expected a SkeletonSample"),
}


@pytest.mark.parametrize("name", WRONG)
def test_samples_that_cannot_be_used_are_refused_with_the_reason(name):
    wrong, reason = WRONG[name]
    with pytest.raises(InputError, match=reason):
        fuse(wrong, PLACED)


def test_samples_as_they_arrive_pass():
    late = samples()
    late[10], late[20] = late[20], late[10]
    check_samples(late, PLACED, None)
    check_samples([], PLACED, None)


def test_stamps_are_compared_on_the_reference_clock():
    ahead = samples(sensor=lambda _: "right", stamp_ns=lambda s: s.stamp_ns + 5 * 10**9)
    both = [each for pair in zip(samples(), ahead, strict=True) for each in pair]
    placed = replace(PLACED, T_reference_sensor={"left": np.eye(4), "right": np.eye(4)})
    with pytest.raises(InputError, match="sort the samples"):
        check_samples(both, placed, None)
    clocks = {"right": Clock(offset_ns=5 * 10**9)}
    check_samples(both, replace(placed, clocks=clocks), None)


def test_sensors_that_are_not_wanted_need_no_extrinsics():
    both = [*samples(), *samples(sensor=lambda _: "right")]
    both.sort(key=lambda sample: sample.stamp_ns)
    check_samples(both, PLACED, ("left",))
    with pytest.raises(InputError, match=r"the parameters have left, right: name those in Pip"):
        fuse(
            samples(sensor=lambda _: "cam"),
            replace(PLACED, reference="cam", T_reference_sensor={"cam": np.eye(4)}),
            PipelineParameters(),
        )


def test_a_frame_that_its_sensor_repeats_is_left_out_with_a_warning():
    frames = samples()
    frozen = [replace(each, positions=frames[60].positions) for each in frames[60:]]
    with pytest.warns(UserWarning, match="24 frames of sensor 'left' repeat the one before"):
        series = fuse([*frames[:60], *frozen], PLACED)
    assert series.stamps_ns[-1] < frozen[8].stamp_ns
