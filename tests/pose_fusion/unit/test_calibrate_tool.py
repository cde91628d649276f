"""``./pose calibrate``: bags in, a YAML out, one line on what is wrong."""

import sys

import pytest
from walking_person import LEFT, RIGHT, angle_deg, samples

from pose_calibration.files.extrinsics_file import load_extrinsics
from pose_core.transforms import inverse
from pose_fusion.tools import calibrate
from pose_io.bag_writer import BagWriter
from pose_io.message_maker import MessageMaker
from pose_io.typestore import make_typestore

MAKE = MessageMaker(make_typestore())
TRUE = inverse(LEFT) @ RIGHT


def message(sensor, persons):
    header = MAKE.header(persons[0].stamp_ns, f"kinect_{sensor}_optical_frame")
    return MAKE.skeletons(
        header,
        [
            MAKE.skeleton(header, f"{index}", one.positions, one.tracking_state)
            for index, one in enumerate(persons)
        ],
    )


def write(path, some, copies=1):
    with BagWriter(path) as bag:
        for one in some:
            topic = f"/kinect_{one.sensor}/skeletons"
            bag.write(topic, message(one.sensor, [one] * copies), one.stamp_ns)
    return path


@pytest.fixture(scope="module")
def walk(tmp_path_factory):
    return write(tmp_path_factory.mktemp("bags") / "walk", samples(duration_s=8.0))


def run(monkeypatch, *arguments):
    monkeypatch.setattr(sys, "argv", ["calibrate", *map(str, arguments)])
    with pytest.raises(SystemExit) as ending:
        calibrate.main()
    return ending.value.code


def test_a_bag_gives_a_file_and_a_table(walk, tmp_path, monkeypatch, capsys):
    output = tmp_path / "extrinsics.yaml"
    assert run(monkeypatch, walk, "-o", output) == 0
    extrinsics = load_extrinsics(output)
    assert angle_deg(extrinsics.T_reference_sensor["right"], TRUE) < 0.3
    printed = capsys.readouterr().out
    assert "distance calibrated, median" in printed
    assert "left_knee" in printed
    assert "above the floor" in printed


def test_the_same_bag_gives_the_same_bytes(walk, tmp_path, monkeypatch):
    for name in ("a.yaml", "b.yaml"):
        assert run(monkeypatch, walk, "-o", tmp_path / name) == 0
    assert (tmp_path / "a.yaml").read_bytes() == (tmp_path / "b.yaml").read_bytes()


def test_the_first_named_sensor_is_the_reference(walk, tmp_path, monkeypatch):
    output = tmp_path / "extrinsics.yaml"
    assert run(monkeypatch, walk, "-o", output, "--sensors", "right", "left") == 0
    assert load_extrinsics(output).reference == "right"


def refused(monkeypatch, capsys, tmp_path, *arguments):
    """The one line on stderr; nothing is written."""
    output = tmp_path / "extrinsics.yaml"
    assert run(monkeypatch, *arguments, "-o", output) == 1
    assert not output.exists()
    (line,) = capsys.readouterr().err.strip().splitlines()
    return line


def test_a_missing_bag_is_reported(tmp_path, monkeypatch, capsys):
    assert "found no bag at" in refused(monkeypatch, capsys, tmp_path, tmp_path / "gone")


def test_a_bag_without_skeletons_is_refused(tmp_path, monkeypatch, capsys):
    with BagWriter(tmp_path / "bag") as bag:
        bag.write("/chatter", MAKE.make("std_msgs/String", data="hello"), 1)
    assert "holds no skeletons" in refused(monkeypatch, capsys, tmp_path, tmp_path / "bag")


def test_a_bag_with_one_sensor_is_refused(tmp_path, monkeypatch, capsys):
    alone = [one for one in samples(duration_s=1.0) if one.sensor == "left"]
    bag = write(tmp_path / "bag", alone)
    assert "one sensor alone (left)" in refused(monkeypatch, capsys, tmp_path, bag)


def test_a_sensor_missing_in_the_bag_is_reported(walk, tmp_path, monkeypatch, capsys):
    line = refused(monkeypatch, capsys, tmp_path, walk, "--sensors", "left", "middle")
    assert "holds no skeletons of middle: it has left, right; name them with --sensors" in line


def test_standing_still_leaves_the_rotation_uncertain(tmp_path, monkeypatch, capsys):
    still = samples(duration_s=4.0, walks=False, moves=False, noise=0.003)
    assert run(monkeypatch, write(tmp_path / "bag", still), "-o", tmp_path / "x.yaml") == 0
    assert "there was little motion: 'right' may be turned by 8°" in capsys.readouterr().out


def test_several_people_with_too_little_data_of_each_are_refused(tmp_path, monkeypatch, capsys):
    bag = write(tmp_path / "bag", samples(duration_s=1.0), copies=2)
    line = refused(monkeypatch, capsys, tmp_path, bag)
    assert "views in left, right agree on none" in line
    assert "--person" in line


def test_a_bad_parameter_is_refused(walk, tmp_path, monkeypatch, capsys):
    line = refused(monkeypatch, capsys, tmp_path, walk, "--median-residual", "7")
    assert line == "error: median_residual = 7.0 m is outside [0.01, 1]"


def test_a_missing_output_folder_is_reported(walk, tmp_path, monkeypatch, capsys):
    assert run(monkeypatch, walk, "-o", tmp_path / "nowhere" / "x.yaml") == 1
    assert "its folder does not exist" in capsys.readouterr().err
