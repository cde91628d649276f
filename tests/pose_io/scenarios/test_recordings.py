"""Recordings of real people by two Kinect v2."""

import functools
import json
import tarfile
from pathlib import Path

import numpy as np
import pytest

from pose_core.joints import JOINT_INDEX, SIDES
from pose_io.recordings.formats import plain_csv, read_recording
from pose_io.recordings.joint_map_files import shipped_joint_map
from pose_io.recordings.recording import Recording, SensorStream
from pose_io.recordings.timeline import make_timeline

pytestmark = pytest.mark.data

ADDRESSES = {"138.251.213.82", "138.251.207.136"}
# Frames in the file, and how many of each sensor's, in the file's order, are no repetitions.
RECORDINGS = {
    "Study_10_Kinect_0_Time_4_06_33_PM": (2014, 1829, 1897),
    "Study_10_Kinect_1_Time_4_10_14_PM": (1866, 1791, 1728),
    "Study_10_Kinect_2_Time_4_14_06_PM": (1549, 1408, 1480),
    "Study_10_Kinect_2_Time_4_17_12_PM": (150, 142, 133),
    "Study_5_Kinect_1_Time_1_55_35_PM": (1598, 1490, 1534),
    "Study_5_Kinect_2_Time_1_58_35_PM": (1742, 1636, 1671),
    "Study_7_Kinect_1_Time_3_08_26_PM": (1556, 1437, 1502),
    "two_persons_Study_22_Kinect_1_Time_2_16_21_PM": (546, 506, 540),
}
# [m] what the median of a bone's length in an adult may be
BONES = {
    ("hip", "knee"): (0.30, 0.55),
    ("knee", "foot"): (0.30, 0.50),
    ("shoulder", "elbow"): (0.20, 0.38),
    ("elbow", "hand"): (0.18, 0.33),
}

recordings = pytest.mark.parametrize("name", RECORDINGS)


@functools.cache
def read(path: Path) -> Recording:
    return read_recording(path)


@pytest.fixture
def recording(shared_data, name) -> Recording:
    return read(shared_data / "kinectmultitrack" / f"{name}.csv.gz")


def joint(stream: SensorStream, name: str) -> np.ndarray:
    return stream.positions[:, JOINT_INDEX[name]]


@recordings
def test_both_sensors_and_all_frames_are_read(recording, name):
    in_file, *distinct = RECORDINGS[name]

    assert recording.format == "kinectmultitrack"
    assert {stream.name for stream in recording.streams} == ADDRESSES
    assert [len(stream) for stream in recording.streams] == [in_file, in_file]
    assert [len(make_timeline(stream)) for stream in recording.streams] == distinct


@recordings
def test_every_frame_is_kept_or_counted_with_increasing_stamps(recording, name):
    for stream in recording.streams:
        for clock in ("sensor", "host"):
            timeline = make_timeline(stream, clock)
            left_out = timeline.counts["frames_repeated"] + timeline.counts["frames_out_of_order"]

            assert len(timeline) + left_out == len(stream)
            assert (np.diff(timeline.time_ns) > 0).all()


@recordings
def test_bones_are_as_long_as_bones_are(recording, name):
    for stream in recording.streams:
        for side in SIDES:
            for (begin, end), (shortest, longest) in BONES.items():
                bone = joint(stream, f"{side}_{end}") - joint(stream, f"{side}_{begin}")
                median = np.nanmedian(np.linalg.norm(bone, axis=1))
                assert shortest < median < longest, (stream.name, side, begin, end)


@recordings
def test_people_stand_upright_in_front_of_the_sensor(recording, name):
    for stream in recording.streams:
        assert np.median(joint(stream, "head")[:, 1] - joint(stream, "torso")[:, 1]) < -0.3
        assert np.median(joint(stream, "left_foot")[:, 1] - joint(stream, "torso")[:, 1]) > 0.6
        assert 1.0 < np.median(joint(stream, "torso")[:, 2]) < 4.5


@recordings
def test_the_left_of_a_person_who_faces_the_sensor_is_at_its_right(recording, name):
    for stream in recording.streams:
        across = joint(stream, "left_shoulder") - joint(stream, "right_shoulder")
        assert np.mean(across[:, 0] > 0) > 0.9


@recordings
def test_the_sensor_s_clock_gives_the_camera_s_even_frames(recording, name):
    """Multiples of 1/30 s, where the times of arrival are spread over whole frames."""
    for stream in recording.streams:
        intervals_ms = np.diff(make_timeline(stream).time_ns) * 1e-6
        frames = np.rint(intervals_ms / (1000 / 30))

        assert np.quantile(np.abs(intervals_ms - frames * 1000 / 30), 0.95) < 4.0
        assert np.quantile(np.abs(np.diff(stream.host_time_ns) * 1e-6 - 1000 / 30), 0.95) > 15.0


def motion_agreement(recording: Recording, clock: str) -> float:
    """Correlation of the trunk's speed as the two sensors saw it, on common stamps."""
    timelines = [make_timeline(stream, clock) for stream in recording.streams]
    begin = max(int(t.time_ns[0]) for t in timelines)
    end = min(int(t.time_ns[-1]) for t in timelines)
    moments = np.arange(0, end - begin, 20_000_000) * 1e-9
    speeds = []
    for stream, timeline in zip(recording.streams, timelines, strict=True):
        torso = joint(stream, "torso")[timeline.frame]
        seconds = (timeline.time_ns - begin) * 1e-9
        path = np.stack([np.interp(moments, seconds, torso[:, axis]) for axis in (0, 2)], axis=1)
        speeds.append(np.linalg.norm(path[5:] - path[:-5], axis=1))
    moving = (speeds[0] < 0.5) & (speeds[1] < 0.5)
    return float(np.corrcoef(speeds[0][moving], speeds[1][moving])[0, 1])


# One person, and more than a few seconds of motion.
LONG = [name for name, frames in RECORDINGS.items() if frames[0] > 1000]


@pytest.mark.parametrize("name", LONG)
def test_two_sensors_agree_better_on_the_motion_by_their_own_clocks(recording, name):
    """The host's queue delays arrivals by up to 0.8 s; the mapped clocks take that out."""
    by_sensor, by_host = (motion_agreement(recording, clock) for clock in ("sensor", "host"))

    assert by_sensor > by_host
    assert by_sensor > 0.8


@pytest.mark.parametrize("name", ["two_persons_Study_22_Kinect_1_Time_2_16_21_PM"])
def test_two_persons_stay_apart(recording, name):
    for stream in recording.streams:
        assert stream.persons == ("0", "1")
        both = [stream.rows(frame) for frame in range(len(stream)) if len(stream.rows(frame)) == 2]
        assert len(both) > 400
        first, second = joint(stream, "torso")[np.array(both).T]
        assert np.median(np.linalg.norm(first - second, axis=1)) > 0.5


@pytest.mark.parametrize("name", ["Study_10_Kinect_2_Time_4_17_12_PM"])
def test_a_real_recording_survives_the_plain_csv(recording, name, tmp_path):
    path = tmp_path / "copy.csv.gz"

    plain_csv.write(path, recording)
    copy = read_recording(path)

    for before, after in zip(recording.streams, copy.streams, strict=True):
        assert after.name == before.name
        np.testing.assert_array_equal(after.host_time_ns, before.host_time_ns)
        np.testing.assert_array_equal(after.sensor_time_ns, before.sensor_time_ns)
        np.testing.assert_allclose(after.positions, before.positions, atol=0.6e-6)


@functools.cache
def azure_frames(archive: Path, motion: str) -> np.ndarray:
    """The joints of one recording, (n, 32, 3) [mm]."""
    frames = []
    with tarfile.open(archive) as tar:
        for member in tar:
            content = tar.extractfile(member) if member.size and member.isfile() else None
            if content is not None and member.name.startswith(motion):
                frames.append(np.array(json.load(content))[:, :3])
    return np.array(frames)


@pytest.mark.parametrize("motion", ["flexion_and_extending_30sec", "o_leg_go_step_30sec"])
def test_an_azure_kinect_s_person_is_right_handed_and_as_long_as_people_are(shared_data, motion):
    joints = azure_frames(shared_data / "azure_single" / "frames.tar.gz", motion)
    assert len(joints) > 200
    nose = joints[:, shipped_joint_map("azure_kinect").joints.index("NOSE")] / 1000

    positions, _ = shipped_joint_map("azure_kinect").convert(
        joints, np.full(joints.shape[:2], 2, dtype=np.uint8)
    )
    at = {name: positions[:, index] for name, index in JOINT_INDEX.items()}

    left = at["left_shoulder"] - at["right_shoulder"]
    up = at["neck"] - at["torso"]
    assert np.mean(np.sum(np.cross(left, up) * (nose - at["head"]), axis=1) > 0) > 0.9
    thigh = np.linalg.norm(at["left_knee"] - at["left_hip"], axis=1)
    assert 0.3 < np.median(thigh) < 0.55


def test_the_left_of_a_person_who_faces_an_azure_kinect_is_at_its_right(shared_data):
    joints = azure_frames(
        shared_data / "azure_single" / "frames.tar.gz", "flexion_and_extending_30sec"
    )

    positions, _ = shipped_joint_map("azure_kinect").convert(
        joints, np.full(joints.shape[:2], 2, dtype=np.uint8)
    )

    left, right = JOINT_INDEX["left_shoulder"], JOINT_INDEX["right_shoulder"]
    assert (positions[:, left, 0] > positions[:, right, 0]).all()
