"""What ``fuse`` says about what went wrong."""

from types import SimpleNamespace

import pytest

from pose_core.estimators.parameters import PipelineParameters
from pose_core.streams.clocks import Clock
from pose_fusion.fusion_lines import delay_lines, fault_lines


def test_nothing_is_said_of_a_sound_recording():
    assert list(fault_lines({"frames": 1000, "sides_swapped": 3, "frames_too_late": 0})) == []


def test_late_frames_are_counted():
    (line,) = fault_lines({"frames": 1000, "frames_too_late": 12})
    assert line.startswith("12 frames came too late")


def test_a_tracker_that_often_exchanges_sides_is_named():
    (line,) = fault_lines({"frames": 1000, "sides_swapped": 400})
    assert "exchanged left and right of 400 pairs of limbs in 1000 frames" in line


def test_a_delay_that_may_be_a_clock_s_offset_is_said_to_be_one_of_both():
    delays_s = {"left": (0.168, 0.008), "right": (0.06, 0.008)}
    pipeline = SimpleNamespace(
        imu_samples=1000,
        clocks={},
        subject=SimpleNamespace(tracker_delays_s=delays_s, imus_late_s=0.0),
    )
    left, right, relative = delay_lines(pipeline)
    assert left == (
        "tracker of left: delay 168 ± 8 ms: longer than usual, or the IMUs' clock is behind, "
        "which looks alike"
    )
    assert right == "tracker of right: delay 60 ± 8 ms"
    assert relative.startswith("delays are relative to the IMUs' stamps: if those are late")


@pytest.mark.parametrize(
    ("ahead_ms", "given", "begin"),
    [
        (-60, {}, "poses: 42 ms before the reference's stamps, whose tracker is probably late"),
        (-146, {}, "poses: at the reference's stamps, though another camera seems 146 ms earlier"),
        (-146, {"tracker_delay": 0.15}, ""),
        (-60, {"estimator": "li2020"}, ""),
        (146, {}, ""),
    ],
)
def test_without_imus_a_camera_that_seems_earlier_is_named(ahead_ms, given, begin):
    pipeline = SimpleNamespace(
        imu_samples=0,
        clocks={"right": Clock(offset_ns=ahead_ms * 1_000_000)},
        parameters=PipelineParameters(**given),
    )
    lines = list(delay_lines(pipeline))
    assert len(lines) == bool(begin)
    assert not begin or lines[0].startswith(begin)
