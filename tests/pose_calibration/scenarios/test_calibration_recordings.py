"""Calibration on recordings of two real Kinects."""

import numpy as np
import pytest

from pose_calibration.geometry.rigid_transform import CalibrationError, estimate_rigid_transform
from pose_calibration.session_calibration import calibrate
from pose_core.streams.clocks import on_reference_clock
from pose_core.streams.samples import SkeletonSample
from pose_core.streams.time_alignment import TimeAligner
from pose_core.transforms import transformed
from pose_io.recordings.formats import read_recording
from pose_io.recordings.timeline import make_timeline

pytestmark = pytest.mark.data

SENSORS = ("left", "right")
WALKS = {  # file, and how far apart the views stay after calibration, mean [m]
    "parallel": ("Study_10_Kinect_0_Time_4_06_33_PM", 0.055),
    "45 degrees": ("Study_10_Kinect_1_Time_4_10_14_PM", 0.068),
    "90 degrees": ("Study_10_Kinect_2_Time_4_14_06_PM", 0.12),
}


def read(shared_data, name):
    """One person's samples of both sensors, in the order of time."""
    recording = read_recording(shared_data / "kinectmultitrack" / f"{name}.csv.gz")
    samples = []
    for sensor, stream in zip(SENSORS, recording.streams, strict=True):
        timeline = make_timeline(stream)
        for frame, time_ns in zip(timeline.frame, timeline.time_ns, strict=True):
            (row,) = stream.rows(int(frame))
            samples.append(
                SkeletonSample(
                    stamp_ns=int(time_ns) - recording.time_zero_ns,
                    sensor=sensor,
                    person=stream.person[row],
                    positions=stream.positions[row],
                    tracking_state=stream.tracking_state[row],
                )
            )
    return sorted(samples, key=lambda sample: sample.stamp_ns)


def views(samples, clocks):
    """Both views at common instants, (n, 15, 3) each."""
    aligner = TimeAligner(SENSORS)
    frames = [
        frame for sample in samples for frame in aligner.add(on_reference_clock(sample, clocks))
    ] + aligner.flush()
    both = [frame.samples for frame in frames if len(frame.samples) == 2]
    return tuple(np.array([samples[name].positions for samples in both]) for name in SENSORS)


def distances(left, right):
    length = np.linalg.norm(left - right, axis=2)
    return length[np.isfinite(length)]


@pytest.mark.parametrize("layout", WALKS)
def test_the_first_half_calibrates_the_second_about_as_well_as_the_second_itself(
    layout, shared_data
):
    name, mean_m = WALKS[layout]
    samples = read(shared_data, name)
    middle_ns = (samples[0].stamp_ns + samples[-1].stamp_ns) // 2
    first = [sample for sample in samples if sample.stamp_ns < middle_ns]
    second = [sample for sample in samples if sample.stamp_ns >= middle_ns]

    extrinsics = calibrate(first, SENSORS).extrinsics
    left, right = views(second, extrinsics.clocks)
    calibrated = distances(left, transformed(extrinsics.T_reference_sensor["right"], right))
    known = np.isfinite(left + right).all(axis=2)
    T_best = estimate_rigid_transform(right[known], left[known])
    best = distances(left, transformed(T_best, right))

    assert calibrated.mean() < mean_m
    assert calibrated.mean() < 1.15 * best.mean()
    assert calibrated.mean() < 0.55 * distances(left, right).mean()


def test_the_floor_lies_a_metre_below_the_level_sensor(shared_data):
    """The recordings note a tilt of 0 and a height of 100 cm for each camera."""
    floor = calibrate(read(shared_data, WALKS["90 degrees"][0]), SENSORS).extrinsics.floor
    assert floor.height == pytest.approx(1.0, abs=0.05)
    assert abs(np.degrees(floor.tilt)) < 2.0


def test_a_recording_of_a_standing_person_is_refused(shared_data):
    samples = read(shared_data, "Study_10_Kinect_2_Time_4_17_12_PM")
    with pytest.raises(CalibrationError, match="too little motion"):
        calibrate(samples, SENSORS)
