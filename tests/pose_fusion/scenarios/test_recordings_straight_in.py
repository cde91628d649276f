"""The offline tools on recordings of skeletons, without a replay and without a bag."""

import sys

import pytest

from pose_fusion.tools import calibrate, fuse
from pose_io.bags import open_bag
from pose_view.tools import report, view

pytestmark = pytest.mark.data

TWO = "kinectmultitrack/Study_10_Kinect_1_Time_4_10_14_PM.csv.gz"
ONE = "azure_imu/walking_positions_3d.csv.gz"


def run(monkeypatch, tool, *words) -> int:
    monkeypatch.setattr(sys, "argv", [tool.__name__, *map(str, words)])
    with pytest.raises(SystemExit) as end:
        tool.main()
    return end.value.code


@pytest.mark.parametrize("recording", [TWO, ONE])
def test_fuse_takes_a_recording_of_two_cameras_or_one(
    shared_data, tmp_path, monkeypatch, recording
):
    assert run(monkeypatch, fuse, shared_data / recording, tmp_path / "fused") == 0

    with open_bag(tmp_path / "fused") as bag:
        assert bag.topics["/humans/bodies/subject/joint_states"].count > 500


def test_calibrate_takes_a_recording(shared_data, tmp_path, monkeypatch):
    found = tmp_path / "extrinsics.yaml"

    assert run(monkeypatch, calibrate, shared_data / TWO, "-o", found) == 0
    assert "right" in found.read_text()


def test_report_takes_a_recording(shared_data, tmp_path, monkeypatch):
    assert run(monkeypatch, report, shared_data / TWO, "-o", tmp_path / "report") == 0
    assert list((tmp_path / "report").glob("*.html"))


def test_people_not_tracked_by_fuse_are_reported(shared_data, tmp_path, monkeypatch, capfd):
    recording = shared_data / "kinectmultitrack"
    recording /= "two_persons_Study_22_Kinect_1_Time_2_16_21_PM.csv.gz"

    assert run(monkeypatch, fuse, recording, tmp_path / "fused") == 0

    told = " ".join(capfd.readouterr().out.split())
    assert "chosen: first; not used:" in told
    assert "skeletons of others (--max-people" in told


def test_several_people_are_fused_if_requested(shared_data, tmp_path, monkeypatch):
    recording = shared_data / "kinectmultitrack"
    recording /= "two_persons_Study_22_Kinect_1_Time_2_16_21_PM.csv.gz"

    assert run(monkeypatch, fuse, recording, tmp_path / "fused", "--max-people", "6") == 0

    with open_bag(tmp_path / "fused") as bag:
        bodies = {topic.split("/")[3] for topic in bag.topics if topic.startswith("/humans/")}
    assert bodies == {"subject", "person_2"}


def test_view_estimates_every_person_of_a_recording(shared_data):
    recording = shared_data / "kinectmultitrack"
    recording /= "two_persons_Study_22_Kinect_1_Time_2_16_21_PM.csv.gz"

    shown = view.read(recording, ("subject_kinect", "subject"), max_people=6)

    assert set(shown.sensors) == {"left", "right"}
    assert set(shown.bodies) == {"subject", "person_2"}
