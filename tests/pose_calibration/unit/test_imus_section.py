import numpy as np
import pytest
import yaml
from scipy.spatial.transform import Rotation

from pose_calibration.files.extrinsics_file import load_extrinsics, save_extrinsics
from pose_calibration.imus.section import load_alignments, load_alignments_if_any, save_alignments
from pose_core.errors import InputError
from pose_core.imu.sensor_to_segment import SensorToSegment
from pose_core.session.extrinsics import extrinsics_from_map

MOUNTINGS = {
    name: SensorToSegment(
        R_sensor_segment=Rotation.from_rotvec(turn).as_matrix(),
        stddev=np.radians([1.0, 2.0, 3.0]),
    )
    for name, turn in {"left_thigh": [0.3, -0.4, 1.2], "torso": [0.0, 3.0, 0.1]}.items()
}


@pytest.fixture
def path(tmp_path):
    """A session that has been calibrated."""
    save_extrinsics(tmp_path / "session.yaml", extrinsics_from_map({"left": np.eye(4)}))
    return tmp_path / "session.yaml"


def test_mountings_come_back_as_they_were_saved(path):
    save_alignments(path, MOUNTINGS)
    loaded = load_alignments(path)
    assert set(loaded) == set(MOUNTINGS)
    for name, alignment in MOUNTINGS.items():
        np.testing.assert_allclose(
            loaded[name].R_sensor_segment, alignment.R_sensor_segment, atol=1e-5
        )
        np.testing.assert_allclose(loaded[name].stddev, alignment.stddev, atol=1e-4)


def test_where_the_kinects_are_stays_in_the_file(path):
    save_alignments(path, MOUNTINGS)
    assert load_extrinsics(path).reference == "left"


def test_the_same_mountings_give_the_same_bytes(path):
    save_alignments(path, MOUNTINGS)
    first = path.read_bytes()
    save_alignments(path, dict(reversed(MOUNTINGS.items())))
    assert path.read_bytes() == first


def test_a_session_without_imus_has_no_mountings(path):
    assert load_alignments(path) is None
    assert load_alignments_if_any(str(path), "") == (str(path), {})


def test_a_file_that_is_yet_to_come_has_no_mountings(tmp_path):
    name = str(tmp_path / "none.yaml")
    assert load_alignments_if_any("", name) == (name, {})
    assert load_alignments_if_any("", "") == ("", {})


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        ({"version": 9}, "version 9, expected 1: calibrate again"),
        ({"segments": [1]}, "expected a mapping"),
        ({"segments": {"left_wing": {}}}, "names left_wing, expected segments"),
        ({"segments": {"torso": 3}}, "expected rotation, stddev_deg"),
        ({"segments": {"torso": {"rotation": [0, 0, 0]}}}, "expected 4 numbers"),
        (
            {"segments": {"torso": {"rotation": [0.0, 0.0, 0.0, 2.0]}}},
            r"length 2\.0000, expected a unit quaternion",
        ),
        (
            {"segments": {"torso": {"rotation": [0, 0, 0, 1], "stddev_deg": [0, 1, 1]}}},
            r"stddev_deg is \[0\.0, 1\.0, 1\.0\], expected",
        ),
    ],
)
def test_a_damaged_section_is_refused_with_its_reason(path, damage, message):
    save_alignments(path, MOUNTINGS)
    document = yaml.safe_load(path.read_text())
    document["imus"].update(damage)
    path.write_text(yaml.safe_dump(document))
    with pytest.raises(InputError, match=message):
        load_alignments(path)
