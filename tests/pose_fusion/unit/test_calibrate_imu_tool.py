"""``./pose calibrate imu``: a bag in, the session's section out, one line on what is wrong."""

import sys
from dataclasses import replace

import numpy as np
import pytest
from rich.console import Console
from session_bag import write_session
from synthetic_body import extrinsics
from worn_imus import merged, moving_wearer

from pose_calibration.files.extrinsics_file import load_extrinsics
from pose_calibration.imus.section import load_alignments
from pose_core.streams.samples import ImuSample
from pose_fusion.parameters import FusionNodeParameters
from pose_fusion.tools import calibrate
from pose_fusion.tools.fuse import fuse
from pose_io.bags import open_bag

DURATION_S = 20.0
PLACED = {sensor: extrinsics().T_map_sensor(sensor) for sensor in ("left", "right")}
EXCHANGED = {"left_thigh": "left_upper_arm", "left_upper_arm": "left_thigh"}


@pytest.fixture(scope="module")
def samples():
    _, _, skeletons, imus = moving_wearer(DURATION_S)
    return merged(skeletons, imus)


@pytest.fixture(scope="module")
def bag(samples, tmp_path_factory):
    return write_session(tmp_path_factory.mktemp("bags") / "session", samples, PLACED)


@pytest.fixture(scope="module")
def exchanged_bag(samples, tmp_path_factory):
    def exchange(sample):
        if not isinstance(sample, ImuSample):
            return sample
        return replace(sample, segment=EXCHANGED.get(sample.segment, sample.segment))

    folder = tmp_path_factory.mktemp("bags")
    return write_session(folder / "exchanged", [exchange(s) for s in samples], PLACED)


def run(monkeypatch, *arguments):
    monkeypatch.setattr(sys, "argv", ["calibrate", "imu", *map(str, arguments)])
    with pytest.raises(SystemExit) as ending:
        calibrate.main()
    return ending.value.code


def test_a_bag_gives_alignments_that_the_fusion_uses(bag, tmp_path, monkeypatch, capsys):
    path = tmp_path / "session.yaml"
    assert run(monkeypatch, bag, "-o", path) == 0
    assert "left_shank" in capsys.readouterr().out
    assert set(load_alignments(path)) == {
        "torso",
        "left_upper_arm",
        "left_forearm",
        "left_thigh",
        "left_shank",
    }
    np.testing.assert_allclose(
        load_extrinsics(path).T_map_sensor("right"), PLACED["right"], atol=1e-5
    )
    parameters = FusionNodeParameters(imus_file=str(path))
    with open_bag(bag) as reader:
        quiet = Console(stderr=True, quiet=True)
        pipeline, _ = fuse(reader, tmp_path / "fused", parameters, console=quiet)
    assert [use.is_aligned for use in pipeline.subject.imu_uses] == [True] * 5


def test_extrinsics_are_read_from_an_existing_file(bag, tmp_path, monkeypatch):
    path = tmp_path / "session.yaml"
    assert run(monkeypatch, bag, "-o", path) == 0
    first, alignments = load_extrinsics(path), load_alignments(path)
    assert run(monkeypatch, bag, "-o", path) == 0
    np.testing.assert_array_equal(
        load_extrinsics(path).T_map_sensor("right"), first.T_map_sensor("right")
    )
    for name, again in load_alignments(path).items():
        known = alignments[name].R_sensor_segment
        np.testing.assert_allclose(again.R_sensor_segment, known, atol=1e-3)


def test_exchanged_sensors_are_reported_and_nothing_is_saved(
    exchanged_bag, tmp_path, monkeypatch, capsys
):
    path = tmp_path / "session.yaml"
    assert run(monkeypatch, exchanged_bag, "-o", path) == 1
    error = capsys.readouterr().err.strip().splitlines()[-1]
    assert "IMU left_thigh: it is exchanged with that of left_upper_arm" in error
    assert not path.exists()


def test_the_remaining_sensors_are_saved_if_requested(exchanged_bag, tmp_path, monkeypatch):
    path = tmp_path / "session.yaml"
    assert run(monkeypatch, exchanged_bag, "-o", path, "--keep-going") == 0
    assert set(load_alignments(path)) == {"torso", "left_forearm", "left_shank"}


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--sensors", "left", "middle"], "holds no skeletons of middle"),
        (["--worn", "left_wing"], "worn names left_wing"),
    ],
)
def test_invalid_input_is_refused_in_one_line(
    bag, tmp_path, monkeypatch, capsys, arguments, message
):
    assert run(monkeypatch, bag, "-o", tmp_path / "session.yaml", *arguments) == 1
    assert message in capsys.readouterr().err.strip().splitlines()[-1]


def test_a_folder_that_does_not_exist_is_refused(tmp_path, monkeypatch, capsys):
    assert run(monkeypatch, "-o", tmp_path / "none" / "session.yaml") == 1
    assert "its folder does not exist" in capsys.readouterr().err
