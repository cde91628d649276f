"""What a bag's own fusion said about its IMUs, in the report."""

import pytest
from fused_bag import S, write_fused_bag

from pose_core.session.extrinsics import extrinsics_from_map
from pose_io.bags import open_bag
from pose_view.recorded_fusion import read_statuses, recorded_fusion
from pose_view.report.analysis import analyse
from pose_view.report.page.page import notes, verdict
from pose_view.report.report_data import Wanted, read_report_data

USED = "used from 0.6 s on, for 98 % of frames"
STUCK = "not used, it has not turned by 8° yet"


def live(**texts):
    """A fusion node's report on IMUs, by segment."""
    uses = {f"imu/{name}": f"{name}: {text}" for name, text in texts.items()}
    return "/operator/fusion", {"subject": "subject", "estimator": "default", **uses}


def offline(**texts):
    """The closing lines of ``./pose fuse``."""
    lines = ["IMU torso: 5 samples left out", *(f"IMU {n}: {text}" for n, text in texts.items())]
    return "fuse", {str(number): line for number, line in enumerate(lines)}


def report_of(path):
    with open_bag(path) as bag:
        return read_report_data(
            bag, Wanted(name="walk"), lambda _, __: extrinsics_from_map({}), lambda share: None
        )


@pytest.mark.parametrize("kind", [live, offline])
def test_the_report_names_the_imus_that_the_recorded_fusion_did_not_use(tmp_path, kind):
    reports = {1.0: kind(torso=STUCK, left_shank=STUCK), 2.0: kind(torso=USED, left_shank=STUCK)}
    recording = report_of(write_fused_bag(tmp_path / "bag", reports))

    assert recording.unused_imus == ("left_shank",)
    analysis = analyse(recording, None)
    assert f"fused: IMU left_shank: {STUCK}." in notes(analysis)
    assert "IMUs that are not used (left shank)" in verdict(analysis)[2]


def test_topics_of_imus_that_the_recorded_fusion_never_mentioned_are_named(tmp_path):
    heard = ("/imu_torso/data", "/imu_leftthigh/data", "/xsens/left")
    path = write_fused_bag(
        tmp_path / "bag", {2.0: live(torso=USED)}, heard, silent=("/imu_left_thigh/data",)
    )
    recording = report_of(path)

    assert recording.unused_imus == ("left_thigh", "leftthigh", "/xsens/left")
    silent, *unnamed = recording.notes[:3]
    assert "/imu_left_thigh/data has no messages" in silent
    assert all("names no segment" in note for note in unnamed)


def test_of_several_fusions_that_of_the_body_counts(tmp_path):
    name, values = live(torso=STUCK)
    other = name + "_kinect", {**values, "subject": "subject_kinect"}
    path = write_fused_bag(
        tmp_path / "bag", {1.0: live(torso=USED), 2.0: other, 3.0: live(torso=USED)}
    )
    with open_bag(path) as bag:
        found = recorded_fusion(bag, read_statuses(bag))

    assert found.unused == {}
    assert found.used_from_ns == {"torso": S}
