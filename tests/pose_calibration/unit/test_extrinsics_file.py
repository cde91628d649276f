"""The YAML file of a calibration."""

from dataclasses import replace

import numpy as np
import pytest
import yaml
from walking_person import POSES, frames

from pose_calibration.extrinsics.extrinsics_calibration import ExtrinsicsCalibrator
from pose_calibration.files.extrinsics_file import (
    load_extrinsics,
    load_extrinsics_of,
    read_document,
    save_extrinsics,
    write_document,
)
from pose_core.errors import InputError
from pose_core.joints import JOINTS
from pose_core.plain_yaml import dump_yaml
from pose_core.session.extrinsics import extrinsics_from_map
from pose_core.streams.clocks import Clock


@pytest.fixture(scope="module")
def extrinsics():
    calibrator = ExtrinsicsCalibrator(("left", "right"))
    for frame in frames():
        calibrator.add(frame)
    return calibrator.solve()


@pytest.fixture
def document(extrinsics, tmp_path):
    save_extrinsics(tmp_path / "good.yaml", extrinsics)
    return yaml.safe_load((tmp_path / "good.yaml").read_text())


def load(document, tmp_path):
    path = tmp_path / "changed.yaml"
    path.write_text(document if isinstance(document, str) else dump_yaml(document))
    return load_extrinsics(path)


def test_what_is_saved_is_loaded(extrinsics, tmp_path):
    path = tmp_path / "extrinsics.yaml"
    save_extrinsics(path, extrinsics)
    loaded = load_extrinsics(path)
    assert loaded.sensors == extrinsics.sensors
    assert loaded.reference == "left"
    assert loaded.clocks == {}
    for name in loaded.sensors:
        np.testing.assert_allclose(
            loaded.T_map_sensor(name), extrinsics.T_map_sensor(name), atol=2e-6
        )


def test_loading_and_saving_again_gives_the_same_transforms(document, tmp_path):
    again = tmp_path / "again.yaml"
    save_extrinsics(again, load(document, tmp_path))
    saved = yaml.safe_load(again.read_text())
    assert saved["map"]["rotation"] == document["map"]["rotation"]
    assert saved["sensors"]["right"]["translation"] == document["sensors"]["right"]["translation"]


def test_the_same_calibration_gives_the_same_bytes(extrinsics, tmp_path):
    for name in ("a.yaml", "b.yaml"):
        save_extrinsics(tmp_path / name, extrinsics)
    assert (tmp_path / "a.yaml").read_bytes() == (tmp_path / "b.yaml").read_bytes()


def test_residuals_and_source_are_there_for_people(document):
    assert document["map"]["source"]
    assert document["sensors"]["right"]["residuals"]["median"] > 0.0


def test_clocks_survive(extrinsics, tmp_path):
    clock = Clock(offset_ns=-21_500_000, drift=-3.2e-5, at_ns=1_700_000_000_123_456_789)
    path = tmp_path / "session.yaml"
    save_extrinsics(path, replace(extrinsics, clocks={"right": clock, "imus": Clock(offset_ns=7)}))
    loaded = load_extrinsics(path).clocks
    assert loaded["right"].offset_ns == clock.offset_ns
    assert loaded["right"].at_ns == clock.at_ns
    assert loaded["right"].drift == pytest.approx(clock.drift)
    assert loaded["imus"].offset_ns == 7


def test_the_clock_offsets_of_version_2_are_read(document, tmp_path):
    document["version"] = 2
    document["sensors"]["right"]["clock_offset_ns"] = -21_500_000
    assert load(document, tmp_path).clocks["right"].offset_ns == -21_500_000


def test_a_file_by_hand_needs_no_residuals(document, tmp_path):
    right = document["sensors"]["right"]
    document["sensors"]["right"] = {key: right[key] for key in ("translation", "rotation")}
    assert load(document, tmp_path).clocks == {}


def test_saving_replaces_and_leaves_nothing_else(extrinsics, tmp_path):
    path = tmp_path / "extrinsics.yaml"
    path.write_text("old")
    save_extrinsics(path, extrinsics)
    assert load_extrinsics(path).reference == "left"
    assert [entry.name for entry in tmp_path.iterdir()] == ["extrinsics.yaml"]


def test_a_folder_that_does_not_exist_is_named(extrinsics, tmp_path):
    with pytest.raises(InputError, match=r"cannot write .*nowhere.*: No such file"):
        save_extrinsics(tmp_path / "nowhere" / "extrinsics.yaml", extrinsics)


def test_a_file_of_other_sensors_is_refused(extrinsics, tmp_path):
    path = tmp_path / "extrinsics.yaml"
    save_extrinsics(path, extrinsics)
    assert load_extrinsics_of(path, ["left", "right"]).sensors == ("left", "right")
    with pytest.raises(
        InputError, match=r"'left' as the reference.*: name them in the file's order"
    ):
        load_extrinsics_of(path, ["right", "left"])
    for others in (["left", "middle"], ["left"]):
        with pytest.raises(InputError, match="calibration of left, right, expected"):
            load_extrinsics_of(path, others)


def test_extrinsics_without_residuals_can_be_saved(tmp_path):
    save_extrinsics(tmp_path / "plain.yaml", extrinsics_from_map(POSES))
    loaded = load_extrinsics(tmp_path / "plain.yaml")
    np.testing.assert_allclose(loaded.T_map_sensor("right"), POSES["right"], atol=2e-6)


def no_version(document):
    document.pop("version")
    return "has version None, expected 1 or 2"


def no_sensors(document):
    document.pop("sensors")
    return "'sensors' is None, expected a mapping"


def no_map(document):
    document.pop("map")
    return "'map' is None, expected a mapping"


def no_reference(document):
    document["reference"] = 3
    return "reference is 3"


def reference_twice(document):
    document["sensors"]["left"] = document["sensors"]["right"]
    return "the reference 'left' is also among the sensors"


def short_translation(document):
    document["sensors"]["right"]["translation"] = [1.0, 2.0]
    return r"translation of 'right' is \[1.0, 2.0\], expected 3 numbers"


def word_in_rotation(document):
    document["map"]["rotation"] = ["a", 0.0, 0.0, 1.0]
    return "rotation of 'map' is .* expected 4 numbers"


def no_unit_quaternion(document):
    document["map"]["rotation"] = [0.0, 0.0, 0.0, 2.0]
    return r"rotation of 'map' has length 2\.0000, expected a unit quaternion"


def offset_in_seconds(document):
    document["clocks"] = {"right": {"offset_ns": 0.02}}
    return "clocks/right/offset_ns is 0.02, expected an integer"


def clock_of_a_stranger(document):
    document["clocks"] = {"top": {"offset_ns": 1}}
    return "clocks has 'top', expected some of right, imus, imus/<segment>: the clock of 'left' is"


def clock_of_the_reference(document):
    document["clocks"] = {"left": {"offset_ns": 1}}
    return "clocks has 'left', expected some of right, imus"


def clock_in_other_words(document):
    document["clocks"] = {"right": {"offset": 1}}
    return "clocks/right has offset, expected 'offset_ns' and"


def drift_of_a_broken_clock(document):
    document["clocks"] = {"right": {"offset_ns": 1, "drift_ppm": 4000.0}}
    return "clocks/right/drift_ppm is 4000.0, expected a number from -1000 to 1000"


def clocks_as_a_list(document):
    document["clocks"] = [1]
    return r"'clocks' is \[1\], expected a mapping"


WRONG = [
    *(no_version, no_sensors, no_map, no_reference, reference_twice),
    *(short_translation, word_in_rotation, no_unit_quaternion, offset_in_seconds),
    *(clock_of_a_stranger, clock_of_the_reference, clock_in_other_words),
    *(drift_of_a_broken_clock, clocks_as_a_list),
]


@pytest.mark.parametrize("change", WRONG, ids=lambda change: change.__name__)
def test_a_wrong_file_is_refused_with_what_is_wrong(change, document, tmp_path):
    message = change(document)
    with pytest.raises(InputError, match=message):
        load(document, tmp_path)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a: [", "is not plain YAML"),
        ("just words", "holds no calibration"),
        ("", "holds no calibration"),
    ],
)
def test_something_else_is_refused(text, message, tmp_path):
    with pytest.raises(InputError, match=message):
        load(text, tmp_path)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(InputError, match=r"cannot read the calibration .*gone\.yaml"):
        load_extrinsics(tmp_path / "gone.yaml")


def test_a_file_of_the_first_version_is_still_read(document, tmp_path):
    document["version"] = 1
    document.pop("view_offsets")
    loaded = load(document, tmp_path)
    assert loaded.sensors == ("left", "right")


def test_view_offsets_are_saved_by_joint(extrinsics, document):
    saved = document["view_offsets"]["right"]
    np.testing.assert_allclose(
        [saved[joint] for joint in JOINTS], extrinsics.view_offsets["right"], atol=1e-4
    )


def test_sections_are_kept_when_the_calibration_is_replaced(extrinsics, tmp_path):
    path = tmp_path / "session.yaml"
    save_extrinsics(path, extrinsics)
    straps = {"bone_lengths": {"left_thigh": 0.43}, "joints": ["head"]}
    write_document(path, {**read_document(path), "straps": straps})
    save_extrinsics(path, extrinsics_from_map(POSES))
    assert read_document(path)["straps"] == straps
    assert load_extrinsics(path).reference == "left"


@pytest.mark.parametrize(
    ("slip", "meant"), [("clock", "clocks"), ("view_offset", "view_offsets"), ("imu", "imus")]
)
def test_a_slip_in_a_section_s_name_is_refused(slip, meant, document, tmp_path):
    file = tmp_path / "slip.yaml"
    file.write_text(yaml.safe_dump({**document, slip: {}}))
    with pytest.raises(InputError, match=f"has a section '{slip}', expected '{meant}'"):
        load_extrinsics(file)
