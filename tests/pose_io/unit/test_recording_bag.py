"""Recordings of skeletons in place of bags."""

import tempfile
from pathlib import Path

import numpy as np
import pytest

from pose_core.errors import InputError
from pose_core.joints import JOINT_INDEX
from pose_core.stamps import NS_PER_S
from pose_io.bag_samples import BagSamples
from pose_io.bags import open_bag
from pose_io.recording_bag import sensor_names, write_recording_bag
from pose_io.recordings.formats import read_recording
from pose_io.topics import sensor_topics

CSV = Path(__file__).parents[2] / "kinect_bridge" / "data" / "two_sensors.csv"


def test_a_recording_opens_as_a_bag_with_a_topic_for_each_sensor():
    with open_bag(CSV) as bag:
        assert sensor_topics(bag) == {
            "left": "/kinect_left/skeletons",
            "right": "/kinect_right/skeletons",
        }
        assert [topic.count for topic in bag.topics.values()] == [6, 6]
        assert bag.path == CSV


def test_its_samples_are_those_that_the_bridges_publish():
    with open_bag(CSV) as bag:
        samples = [sample for sample in BagSamples(bag, "anna") if sample.sensor == "left"]

    assert len(samples) == 5  # nobody is seen in one of the six
    stamps = np.array([sample.stamp_ns for sample in samples])
    np.testing.assert_allclose(np.diff(stamps) % (100 * 10**6), 0, atol=1000)
    shoulder = samples[0].positions[JOINT_INDEX["left_shoulder"]]
    np.testing.assert_allclose(shoulder, [0.2, -0.35, 2.5])


def test_a_clock_that_is_no_unix_time_is_moved_to_one_that_stamps_can_hold():
    with open_bag(CSV) as bag:  # begins at 100 s
        assert bag.start_ns == pytest.approx(10**9 * NS_PER_S, abs=NS_PER_S)


def test_what_was_made_for_it_goes_with_it(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))

    with open_bag(CSV):
        assert len(list(tmp_path.iterdir())) == 1

    assert list(tmp_path.iterdir()) == []


def test_the_same_recording_gives_the_same_bytes(tmp_path):
    recording = read_recording(CSV)
    contents = []
    for folder in (tmp_path / "a" / "bag", tmp_path / "b" / "bag"):
        write_recording_bag(recording, folder)
        contents.append((folder / "bag.mcap").read_bytes())

    assert contents[0] == contents[1]


@pytest.mark.parametrize(
    ("names", "expected"),
    [
        (("left", "back"), ("left", "back")),
        (("138.251.213.82",), ("left",)),
        (("138.251.213.82", "138.251.207.136"), ("left", "right")),
        (("a b", "c", "d"), ("left", "right", "sensor_2")),
    ],
)
def test_sensors_are_called_as_in_the_file_or_as_usual(names, expected):
    assert sensor_names(names) == expected


def test_a_file_that_is_neither_bag_nor_recording_is_one_line(tmp_path):
    path = tmp_path / "notes.txt"
    path.write_text("nothing, of, this\n")

    with pytest.raises(InputError, match=r"is not a bag: .* or a recording of skeletons") as error:
        open_bag(path)
    assert "\n" not in str(error.value)


def test_what_a_recording_loses_is_remarked(tmp_path):
    path = tmp_path / "rounded.csv"
    path.write_text(CSV.read_text().replace("left,100.100,7.100", "left,100.000,7.000"))

    with open_bag(path) as bag:
        (remark,) = bag.remarks
        assert "is the time column rounded?" in remark
    with open_bag(CSV) as bag:
        assert not bag.remarks
