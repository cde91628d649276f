"""What is exported: reading the bag, the plain formats, the tool (synthetic motion)."""

import csv
import json
import sys
from pathlib import Path

import numpy as np
import pytest
from exported_motion import FRAME_NS, MODELS_BY_NAME, START_NS, root_rotation, write_motion_bag
from scipy.spatial.transform import Rotation

from pose_core.errors import InputError
from pose_core.joints import JOINT_INDEX, JOINTS, SIDES
from pose_fusion.tools.export import main
from pose_io.bag_writer import BagWriter
from pose_io.bags import open_bag
from pose_io.export.motion import chosen_body, read_motion
from pose_io.export.opensim import OPENSIM_MODELS, coordinate_map
from pose_io.export.registry import EXPORTERS

MODEL = MODELS_BY_NAME["li2020"]
COUNT = 30


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """A bag's path, and the degrees of freedom and joints in it."""
    path = tmp_path_factory.mktemp("export") / "bag"
    return path, *write_motion_bag(path, MODEL, COUNT)


def export(monkeypatch, *words):
    """Run the tool; its exit code."""
    monkeypatch.setattr(sys, "argv", ["export", *map(str, words)])
    with pytest.raises(SystemExit) as ending:
        main()
    return ending.value.code


def test_csv_keeps_every_instant_with_its_own_stamp_and_units(recorded, tmp_path, monkeypatch):
    path, dof, joints = recorded
    file = tmp_path / "motion.csv"

    assert export(monkeypatch, path, "--to", "csv", "-o", file) == 0

    rows = list(csv.DictReader(file.open()))
    assert [int(row["stamp_ns"]) for row in rows] == [
        START_NS + index * FRAME_NS for index in range(COUNT)
    ]
    knee = np.degrees(dof[:, MODEL.dof_index["left_knee_flexion"]])
    found = [float(row["left_knee_flexion_deg"]) for row in rows]
    np.testing.assert_allclose(found, knee, atol=0.01)
    hand = [[float(row[f"right_hand_{axis}_m"]) for axis in "xyz"] for row in rows]
    np.testing.assert_allclose(hand, joints[:, JOINT_INDEX["right_hand"]], atol=1e-3)
    np.testing.assert_allclose(float(rows[3]["pelvis_x_m"]), dof[3, 0], atol=1e-3)
    assert float(rows[3]["left_knee_flexion_stddev_deg"]) == pytest.approx(np.degrees(0.01))


def test_json_lines_hold_position_and_orientation_of_each_segment(recorded, tmp_path, monkeypatch):
    path, dof, joints = recorded
    file = tmp_path / "motion.json"

    assert export(monkeypatch, path, "--to", "json", "-o", file) == 0

    lines = [json.loads(line) for line in file.read_text().splitlines()]
    assert [line["stamp_ns"] for line in lines][:2] == [START_NS, START_NS + FRAME_NS]
    pelvis = [line["segments"]["pelvis"] for line in lines]
    np.testing.assert_allclose([s["position"] for s in pelvis], dof[:, :3], atol=1e-3)
    turned = Rotation.from_quat([s["quaternion"] for s in pelvis])
    error = turned.inv() * Rotation.from_matrix(root_rotation(dof))
    assert np.degrees(error.magnitude()).max() < 0.01
    shank = [line["segments"]["left_shank"] for line in lines]
    R = Rotation.from_quat([s["quaternion"] for s in shank])
    bone = joints[:, JOINT_INDEX["left_foot"]] - joints[:, JOINT_INDEX["left_knee"]]
    np.testing.assert_allclose(R.apply([0.0, 0.0, -0.40]), bone, atol=1e-3)
    knees = joints[:, JOINT_INDEX["left_knee"]]
    np.testing.assert_allclose([s["position"] for s in shank], knees, atol=1e-3)


def test_exported_quaternions_have_no_sign_changes(recorded, tmp_path, monkeypatch):
    file = tmp_path / "motion.json"
    export(monkeypatch, recorded[0], "--to", "json", "-o", file)
    segments = [json.loads(line)["segments"] for line in file.read_text().splitlines()]
    for name in segments[0]:
        q = np.array([each[name]["quaternion"] for each in segments])
        assert (np.sum(q[1:] * q[:-1], axis=1) > 0.9).all()


def test_resampling_to_a_lower_rate_preserves_the_motion(recorded):
    path, _, joints = recorded
    with open_bag(path) as bag:
        motion = read_motion(bag).at_rate(10.0)
    assert len(motion) == 10
    np.testing.assert_allclose(motion.joints, joints[::3], atol=1e-4)
    np.testing.assert_allclose(motion.pose.positions, joints[::3], atol=1e-4)


def test_the_default_rate_is_the_mean_rate_without_gaps(tmp_path):
    odd = {index for index in range(60) if index % 3 == 2}  # two frames, then one is missing
    write_motion_bag(tmp_path / "bag", MODEL, 90, drop=odd | set(range(60, 80)))
    with open_bag(tmp_path / "bag") as bag:
        assert read_motion(bag).mean_rate == pytest.approx(30.0 * 48 / 67, rel=1e-3)


def test_poses_between_frames_are_interpolated(recorded):
    path, _, joints = recorded
    with open_bag(path) as bag:
        motion = read_motion(bag).at_rate(60.0)
    middle = 0.5 * (joints[4] + joints[5])
    np.testing.assert_allclose(motion.joints[9], middle, atol=1e-4)
    # The body bends and turns between two frames, joints are drawn straight: less than 2 mm.
    np.testing.assert_allclose(motion.pose.positions[9], middle, atol=2e-3)


def test_frames_in_a_gap_are_marked_and_have_no_joints(tmp_path):
    write_motion_bag(tmp_path / "bag", MODEL, COUNT, drop=range(10, 20))
    with open_bag(tmp_path / "bag") as bag:
        motion = read_motion(bag).at_rate(30.0)
    assert list(np.flatnonzero(motion.is_gap)) == list(range(10, 20))
    assert list(np.flatnonzero(np.isnan(motion.joints[:, 0, 0]))) == list(range(10, 20))
    assert np.isfinite(motion.dof).all()


UNKNOWN = {"left_knee_flexion": range(10, 13), "neck_flexion": range(5, 20)}


@pytest.fixture(scope="module")
def partly_unknown(tmp_path_factory):
    path = tmp_path_factory.mktemp("unknown") / "bag"
    return path, *write_motion_bag(path, MODEL, COUNT, unknown=UNKNOWN)


def test_csv_leaves_unknown_angles_and_what_turns_with_them_empty(
    partly_unknown, tmp_path, monkeypatch, capsys
):
    file = tmp_path / "motion.csv"

    assert export(monkeypatch, partly_unknown[0], "--to", "csv", "-o", file) == 0

    rows = list(csv.DictReader(file.open()))
    for column in ("left_knee_flexion_deg", "segment_left_shank_qw"):
        assert [index for index, row in enumerate(rows) if not row[column]] == [10, 11, 12]
    assert all(row["segment_left_thigh_qw"] and row["left_knee_x_m"] for row in rows)
    assert capsys.readouterr().out.splitlines()[1] == (
        "angles unknown to the fusion in 15 of 30 frames, for up to 0.5 s, from 0.2 s on "
        "(neck_flexion, left_knee_flexion): their cells are empty"
    )


@pytest.mark.parametrize("form", ["mot", "bvh", "json"])
def test_formats_without_gaps_say_which_angles_they_interpolate(
    partly_unknown, tmp_path, monkeypatch, capsys, form
):
    words = ("--to", form, "-o", tmp_path / "motion", "--rate", "60")

    assert export(monkeypatch, partly_unknown[0], *words) == 0

    output = capsys.readouterr().out
    assert (
        "angles unknown to the fusion in 31 of 59 frames, for up to 0.5 s, from 0.2 s on (neck"
        in output
    )
    assert "left_knee_flexion): they are interpolated" in output


def test_positions_alone_have_no_unknown_angles(partly_unknown, tmp_path, monkeypatch, capsys):
    assert export(monkeypatch, partly_unknown[0], "--to", "trc", "-o", tmp_path / "m.trc") == 0
    assert "angles unknown" not in capsys.readouterr().out


def test_exported_bone_lengths_are_the_measured_ones(recorded):
    with open_bag(recorded[0]) as bag:
        motion = read_motion(bag)
    length = np.linalg.norm(motion.offsets[JOINT_INDEX["left_knee"]])
    assert length == pytest.approx(0.42, abs=1e-4)
    assert max(motion.rigid_residuals) < 1e-4


@pytest.mark.parametrize("form", EXPORTERS)
def test_every_format_replaces_an_existing_file(recorded, tmp_path, monkeypatch, capsys, form):
    file = tmp_path / f"motion.{form}"
    file.write_text("old")

    assert export(monkeypatch, recorded[0], "--to", form, "-o", file) == 0

    assert file.stat().st_size > len("old")
    assert list(tmp_path.iterdir()) == [file]
    output = capsys.readouterr().out
    assert output.startswith(f"{file}: {COUNT} frames of 'subject'")


def test_a_failure_leaves_the_old_file(recorded, tmp_path, monkeypatch, capsys):
    file = tmp_path / "motion.csv"
    file.write_text("old")
    monkeypatch.setattr("os.replace", lambda *_: (_ for _ in ()).throw(OSError(28, "full disk")))

    assert export(monkeypatch, recorded[0], "--to", "csv", "-o", file) == 1

    assert file.read_text() == "old"
    assert list(tmp_path.iterdir()) == [file]
    assert capsys.readouterr().err == f"error: cannot write the motion {file}: full disk\n"


def test_a_bag_without_a_fused_pose_says_what_to_do(tmp_path, monkeypatch, capsys):
    with BagWriter(tmp_path / "bag") as bag:
        bag.write("/text", bag.typestore.types["std_msgs/msg/String"](data="x"), 1)

    assert export(monkeypatch, tmp_path / "bag", "--to", "csv", "-o", tmp_path / "x.csv") == 1

    error = capsys.readouterr().err
    assert error.startswith("error: ")
    assert f"./pose fuse {tmp_path / 'bag'} OUT" in error
    assert len(error.splitlines()) == 1


def test_an_unknown_person_is_reported(recorded):
    with (
        open_bag(recorded[0]) as bag,
        pytest.raises(InputError, match=r"no 'other': choose among \w+"),
    ):
        read_motion(bag, "other")


def test_one_of_several_people_must_be_chosen(tmp_path):
    with BagWriter(tmp_path / "bag") as bag:
        for body in ("anna", "ben"):
            text = bag.typestore.types["std_msgs/msg/String"](data="x")
            bag.write(f"/humans/bodies/{body}/skeleton", text, 1)
    with open_bag(tmp_path / "bag") as bag, pytest.raises(InputError, match=r"anna, ben.*--body"):
        read_motion(bag)


def test_bodies_fused_for_comparison_are_not_offered(recorded, tmp_path):
    with open_bag(recorded[0]) as bag:
        body = chosen_body(bag, "")
    with BagWriter(tmp_path / "bag") as bag:
        text = bag.typestore.types["std_msgs/msg/String"](data="x")
        for name in (f"{body}_imu", body, f"{body}_kinect"):
            bag.write(f"/humans/bodies/{name}/skeleton", text, 1)

    with open_bag(tmp_path / "bag") as bag:
        assert chosen_body(bag, "") == body
        assert chosen_body(bag, f"{body}_imu") == f"{body}_imu"


def test_a_missing_folder_is_made(recorded, tmp_path, monkeypatch):
    assert export(monkeypatch, recorded[0], "--to", "bvh", "-o", tmp_path / "new" / "x.bvh") == 0
    assert (tmp_path / "new" / "x.bvh").exists()


def test_a_folder_instead_of_a_file_is_refused(recorded, tmp_path, monkeypatch, capsys):
    assert export(monkeypatch, recorded[0], "--to", "bvh", "-o", tmp_path) == 1
    assert "name a file" in capsys.readouterr().err


def test_an_invalid_rate_is_refused(recorded, tmp_path, monkeypatch, capsys):
    words = ("--to", "bvh", "-o", tmp_path / "x.bvh", "--rate", "0")
    assert export(monkeypatch, recorded[0], *words) == 2
    assert "outside [1, 1000]" in capsys.readouterr().err


def test_every_joint_has_columns_in_csv(recorded, tmp_path, monkeypatch):
    file = tmp_path / "motion.csv"
    export(monkeypatch, recorded[0], "--to", "csv", "-o", file)
    header = file.read_text().splitlines()[0].split(",")
    assert {f"{joint}_x_m" for joint in JOINTS} <= set(header)
    assert len(header) == len(set(header))


def test_the_map_to_opensim_in_the_documentation_is_the_one_in_the_code():
    text = (Path(__file__).resolve().parents[3] / "docs" / "export.md").read_text()
    rows = [line for line in text.splitlines() if line.startswith("| `")]
    rajagopal, gait2392 = (coordinate_map(OPENSIM_MODELS[m]) for m in ("rajagopal2016", "gait2392"))
    for ours, (theirs, sign) in rajagopal.items():
        side = ours.split("_")[0] if ours.startswith(SIDES) else ""
        left = ours.replace(side, "<side>", 1) if side else ours
        right = f"{theirs[:-2]}_<s>" if side else theirs
        other = gait2392[ours][1]
        mark = "+" if sign > 0.0 else "−"
        if other != sign:
            mark += f" (gait2392: {'+' if other > 0.0 else '−'})"
        assert any(row.startswith(f"| `{left}` | `{right}` | {mark} |") for row in rows), ours


@pytest.mark.parametrize("name", OPENSIM_MODELS)
def test_the_pelvis_offset_in_the_documentation_is_the_one_in_the_code(name):
    text = (Path(__file__).resolve().parents[3] / "docs" / "export.md").read_text()
    x, y, _ = OPENSIM_MODELS[name].hips_in_pelvis
    digits = 6 if name == "rajagopal2016" else 4
    assert f"(−{-x:.{digits}f}, −{-y:.{digits}f}, 0) m" in text


@pytest.mark.parametrize("kind", ["csv", "json"])
@pytest.mark.parametrize("rate", [30, 60, 100])
def test_tables_are_resampled_if_a_rate_is_given(recorded, tmp_path, monkeypatch, kind, rate):
    file = tmp_path / "motion"

    assert export(monkeypatch, recorded[0], "--to", kind, "-o", file, "--rate", rate) == 0

    rows = csv.DictReader(file.open()) if kind == "csv" else map(json.loads, file.open())
    steps_ns = np.diff([int(row["stamp_ns"]) for row in rows])
    np.testing.assert_allclose(steps_ns, 1e9 / rate, atol=20_000)
