"""What ``fuse`` says about what went wrong."""

from pose_fusion.fusion_lines import fault_lines


def test_nothing_is_said_of_a_sound_recording():
    assert list(fault_lines({"frames": 1000, "sides_swapped": 3, "frames_too_late": 0})) == []


def test_late_frames_are_counted():
    (line,) = fault_lines({"frames": 1000, "frames_too_late": 12})
    assert line.startswith("12 frames came too late")


def test_a_tracker_that_often_exchanges_sides_is_named():
    (line,) = fault_lines({"frames": 1000, "sides_swapped": 400})
    assert "exchanged left and right of 400 pairs of limbs in 1000 frames" in line
