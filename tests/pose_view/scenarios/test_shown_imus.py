"""What viewer and report show of IMUs (synthetic)."""

from dataclasses import replace

import pytest
from fused_bag import S, write_fused_bag
from session_bag import write_session
from synthetic_body import extrinsics
from worn_imus import merged, moving_wearer

from pose_io.bags import open_bag
from pose_view.recorded import Recorded
from pose_view.report.analysis import analyse
from pose_view.report.figures.courses import attitude_figures, attitude_sources
from pose_view.report.page.page import render_page
from pose_view.report.report_data import Wanted, read_report_data
from pose_view.tools.view import read

STUCK = "left_forearm"


@pytest.fixture(scope="module")
def worn(tmp_path_factory):
    """A bag of cameras and IMUs, of which one always sends the same orientation."""
    _, _, skeletons, imus = moving_wearer(20.0)
    first = {s.segment: s for s in reversed(imus)}
    sent = [replace(first[STUCK], stamp_ns=s.stamp_ns) if s.segment == STUCK else s for s in imus]
    placed = {sensor: extrinsics().T_map_sensor(sensor) for sensor in ("left", "right")}
    return write_session(tmp_path_factory.mktemp("imus") / "worn", merged(skeletons, sent), placed)


def test_an_imu_that_no_computed_body_uses_is_named_and_not_drawn(worn, capsys):
    recorded = read(worn, ("subject",))

    (line,) = [remark for remark in recorded.remarks if STUCK in remark]
    assert line.startswith(f"subject: IMU {STUCK}: not used, ")
    assert line in capsys.readouterr().err.splitlines()
    assert recorded.has_imus
    assert recorded.snapshot(0.0).imus == ()
    drawn = recorded.snapshot(8.0).imus
    assert "left_thigh" in drawn
    assert STUCK not in drawn


def test_the_default_report_has_zhang2015s_figures_and_says_what_they_show(worn):
    with open_bag(worn) as bag:
        recording = read_report_data(
            bag, Wanted(name="worn"), lambda _, __: extrinsics(), lambda _: None
        )
    analysis = analyse(recording, None)

    assert list(recording.methods) == ["mean", "joint_kf", "default+imus"]
    roles = {"Kinect": "left", "IMUs": "imu", "zhang2015": "zhang2015", "fused": "default+imus"}
    assert attitude_sources(analysis) == roles
    drawing = attitude_figures(analysis).pictures[0].svg
    assert drawing.count('class="method-role-zhang2015"') == 3  # pitch, yaw and roll
    page = render_page(analysis, "left_hand")
    assert "fused: default + IMUs" in page
    assert "that Kinect does not track both ends of the limb" in page


def test_imus_of_a_recorded_body_are_drawn_from_when_its_fusion_used_them(tmp_path):
    uses = {"imu/torso": "torso: not used, not aligned yet", "imu/head": "head: not used, stuck"}
    values = {"subject": "subject", "estimator": "default", **uses}
    aligned = {**values, "imu/torso": "torso: used from 2.0 s on"}
    reports = {1.0: ("/fusion", values), 3.0: ("/fusion", aligned)}
    with open_bag(write_fused_bag(tmp_path / "bag", reports)) as bag:
        recorded = Recorded(bag)

    assert recorded.remarks == ["IMU head: not used, stuck"]
    since_s = 3.0 - recorded.start_ns / S
    assert recorded.snapshot(since_s - 0.1).imus == ()
    assert recorded.snapshot(since_s + 0.1).imus == ("torso",)
