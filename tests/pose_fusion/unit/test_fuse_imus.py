"""``./pose fuse`` tells what became of each IMU (synthetic)."""

import re
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from session_bag import write_session
from synthetic_body import extrinsics
from worn_imus import IMU_SEGMENTS, merged, moving_wearer

from pose_core.errors import InputError, PoseError
from pose_core.streams.repeated_frames import FROZEN_FRAMES
from pose_fusion.tools import fuse
from pose_io.bag_samples import read_estimates
from pose_io.bags import open_bag
from pose_view.report.report_data import Wanted, read_report_data

DURATION_S = 9.0
LIES = "left_forearm"


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    _, _, skeletons, imus = moving_wearer(DURATION_S)
    first = {s.segment: s for s in reversed(imus)}
    placed = {sensor: extrinsics().T_map_sensor(sensor) for sensor in ("left", "right")}
    samples = [replace(first[LIES], stamp_ns=s.stamp_ns) if s.segment == LIES else s for s in imus]
    return write_session(tmp_path_factory.mktemp("fuse") / "in", merged(skeletons, samples), placed)


def not_placed(*_):
    raise InputError("of no sensor")


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [([], "not used, "), (["--no-use-imus"], "use_imus is false")],
)
def test_fuse_prints_one_line_for_each_imu(bag, tmp_path, monkeypatch, capsys, arguments, reason):
    monkeypatch.setattr(sys, "argv", ["fuse", str(bag), str(tmp_path / "out"), *arguments])
    fuse.run()
    printed = capsys.readouterr().out.splitlines()
    assert sum("tracker of " in line for line in printed) == (0 if arguments else 2)
    lines = [line.split() for line in printed if "IMU " in line]
    told = {words[1].rstrip(":"): " ".join(words[2:]) for words in lines if words[0] == "IMU"}
    assert sorted(told) == sorted(IMU_SEGMENTS)
    assert reason in told[LIES]
    assert ("used from" in told["left_thigh"]) == (not arguments)

    with open_bag(tmp_path / "out") as fused:
        wanted = Wanted(name="fused")
        read = read_report_data(fused, wanted, not_placed, lambda _: None)
    assert {line.strip() for line in printed[1:]} <= set(read.said)


def test_a_session_file_that_does_not_exist_is_an_error(bag, tmp_path, monkeypatch):
    words = ["fuse", str(bag), str(tmp_path / "out"), "--imus-file", str(tmp_path / "none.yaml")]
    monkeypatch.setattr(sys, "argv", words)
    with pytest.raises(InputError, match=r"none\.yaml does not exist, or has no IMUs' alignments"):
        fuse.run()


def test_the_imu_estimator_reports_missing_imus(tmp_path, monkeypatch):
    _, _, skeletons, _ = moving_wearer(4.0)
    placed = {sensor: extrinsics().T_map_sensor(sensor) for sensor in ("left", "right")}
    cameras = write_session(tmp_path / "in", skeletons, placed)
    arguments = ["fuse", str(cameras), str(tmp_path / "out"), "--estimator", "imu"]
    monkeypatch.setattr(sys, "argv", arguments)
    with pytest.raises(InputError, match="holds no IMU's orientations"):
        fuse.run()


def test_the_imu_estimator_without_a_pose_says_which_imus_the_cameras_could_not_align(
    bag, tmp_path, monkeypatch
):
    arguments = ["fuse", str(bag), str(tmp_path / "out"), "--estimator", "imu"]
    monkeypatch.setattr(sys, "argv", arguments)
    with pytest.raises(InputError, match=f"gave no pose: .* IMU {LIES}: not used, it has not"):
        fuse.run()


def test_imus_whose_orientations_are_all_inverse_do_not_change_the_result(tmp_path, monkeypatch):
    _, _, skeletons, imus = moving_wearer(DURATION_S)
    inverse = [replace(s, orientation=s.orientation * [-1, -1, -1, 1]) for s in imus]
    placed = {sensor: extrinsics().T_map_sensor(sensor) for sensor in ("left", "right")}
    bag = write_session(tmp_path / "in", merged(skeletons, inverse), placed)
    angles = []
    for name, words in {"with": [], "without": ["--no-use-imus"]}.items():
        monkeypatch.setattr(sys, "argv", ["fuse", str(bag), str(tmp_path / name), *words])
        fuse.run()
        with open_bag(tmp_path / name) as fused:
            angles.append(read_estimates(fused))
    _, first, second = np.intersect1d(*(a.stamps_ns for a in angles), return_indices=True)
    assert len(first) > 100 * (DURATION_S - 2.0)
    np.testing.assert_allclose(angles[0].position[first], angles[1].position[second], atol=1e-6)


CSV = Path(__file__).parents[2] / "kinect_bridge" / "data" / "two_sensors.csv"


def test_rows_that_are_left_out_are_named_also_where_nothing_can_be_fused(
    tmp_path, monkeypatch, capsys
):
    path = tmp_path / "rounded.csv"
    path.write_text(CSV.read_text().replace("left,100.100,7.100", "left,100.000,7.000"))
    monkeypatch.setattr(sys, "argv", ["fuse", str(path), str(tmp_path / "out")])
    with pytest.raises(PoseError):
        fuse.run()
    assert "sensor left: 1 of 5 rows left out" in capsys.readouterr().err


def test_a_tracker_that_repeats_one_frame_is_named_with_their_number(tmp_path, monkeypatch, capsys):
    _, _, skeletons, _ = moving_wearer(4.0)
    right = [one for one in skeletons if one.sensor == "right"]
    still = {one.stamp_ns: right[60] for one in right[60:90]}
    frozen = [
        replace(one, positions=still[one.stamp_ns].positions)
        if one.sensor == "right" and one.stamp_ns in still
        else one
        for one in skeletons
    ]
    placed = {sensor: extrinsics().T_map_sensor(sensor) for sensor in ("left", "right")}
    bag = write_session(tmp_path / "in", frozen, placed)
    monkeypatch.setattr(sys, "argv", ["fuse", str(bag), str(tmp_path / "out")])
    fuse.run()
    (line,) = [each for each in capsys.readouterr().out.splitlines() if "repeats one frame" in each]
    assert line.strip().startswith(f"right: {30 - FROZEN_FRAMES} frames left out")


@pytest.mark.parametrize(
    ("arguments", "held"),
    [
        ([], "poses by the IMUs alone"),
        (["--no-use-imus"], r"poses by prediction for (0\.8|0\.9|1\.0) s of it, then none"),
    ],
)
def test_fuse_says_when_no_camera_saw_the_person(tmp_path, monkeypatch, capsys, arguments, held):
    _, _, skeletons, imus = moving_wearer(12.0)
    first_ns = min(s.stamp_ns for s in imus)
    seen = [s for s in skeletons if not 6.0 < (s.stamp_ns - first_ns) * 1e-9 < 9.0]
    placed = {sensor: extrinsics().T_map_sensor(sensor) for sensor in ("left", "right")}
    gap = write_session(tmp_path / "in", merged(seen, imus), placed)
    monkeypatch.setattr(sys, "argv", ["fuse", str(gap), str(tmp_path / "out"), *arguments])
    fuse.run()
    lines = [line for line in capsys.readouterr().out.splitlines() if "no camera" in line]
    assert len(lines) == 1
    when = r"for (2\.8|2\.9|3\.0) s from 6\.[0-2] s"
    assert re.fullmatch(f"  no camera saw the person {when}: {held}", lines[0])
