import numpy as np
import pytest
from moving_body import motion

from pose_core.body.joint_angles import ANGLES, joint_angles
from pose_core.errors import InputError
from pose_core.joints import JOINT_INDEX, JOINTS
from pose_io.references.reading import read_reference

RATE = 50.0
GAP = slice(20, 25)  # frames in which the left hand is hidden


@pytest.fixture
def body():
    series = motion(rate=RATE, duration_s=4.0)
    series.positions[GAP, JOINT_INDEX["left_hand"]] = np.nan
    return series


def write_c3d(path, body):
    """By an independent library."""
    ezc3d = pytest.importorskip("ezc3d")
    file = ezc3d.c3d()
    file["parameters"]["POINT"]["UNITS"]["value"] = ["mm"]
    file["parameters"]["POINT"]["RATE"]["value"] = [RATE]
    file["parameters"]["POINT"]["LABELS"]["value"] = list(JOINTS)
    points = np.ones((4, len(JOINTS), len(body)))
    points[:3] = 1000.0 * body.positions.transpose(2, 1, 0)
    file["data"]["points"] = points
    file.write(str(path))


def write_trc(path, body):
    """By OpenSim itself."""
    opensim = pytest.importorskip("opensim")
    table = opensim.TimeSeriesTableVec3()
    table.setColumnLabels(list(JOINTS))
    for stamp_ns, positions in zip(body.stamps_ns, body.positions, strict=True):
        row = opensim.RowVectorVec3([opensim.Vec3(*map(float, 1000.0 * p)) for p in positions])
        table.appendRow(stamp_ns * 1e-9, row)
    table.addTableMetaDataString("DataRate", f"{RATE:g}")
    table.addTableMetaDataString("Units", "mm")
    opensim.TRCFileAdapter.write(table, str(path))


def write_vicon_csv(path, body):
    """As Nexus exports it, with a section before it that does not count."""
    labels = ",,".join(f",subject:{name}" for name in JOINTS)
    lines = [
        "Model Outputs",
        f"{RATE:g}",
        ",,subject:LKneeAngles,,",
        "Frame,Sub Frame,X,Y,Z",
        ",,deg,deg,deg",
        "1,0,1.0,2.0,3.0",
        "",
        "Trajectories",
        f"{RATE:g}",
        f",{labels},,",
        "Frame,Sub Frame," + ",".join("XYZ" for _ in JOINTS).replace("XYZ", "X,Y,Z"),
        ",," + ",".join("mm,mm,mm" for _ in JOINTS),
    ]
    for number, positions in enumerate(1000.0 * body.positions, start=101):
        cells = ["" if np.isnan(value) else f"{value:.5f}" for value in positions.ravel()]
        lines.append(",".join([str(number), "0", *cells]))
    path.write_text("\r\n".join([*lines, ""]), encoding="utf-8-sig")


WRITERS = {"c3d": write_c3d, "trc": write_trc, "csv": write_vicon_csv}


@pytest.mark.parametrize("kind", WRITERS)
def test_joint_centres_of_another_program_s_file_are_read_as_they_were(kind, body, tmp_path):
    path = tmp_path / f"reference.{kind}"
    WRITERS[kind](path, body)
    found = read_reference(path)
    np.testing.assert_allclose(found.skeleton.positions, body.positions, atol=1e-5)
    assert np.diff(found.skeleton.stamps_ns).tolist() == [20_000_000] * (len(body) - 1)
    assert not found.synthetic


@pytest.mark.parametrize("kind", WRITERS)
def test_a_hidden_point_is_unknown(kind, body, tmp_path):
    path = tmp_path / f"reference.{kind}"
    WRITERS[kind](path, body)
    hand = read_reference(path).skeleton.positions[:, JOINT_INDEX["left_hand"]]
    assert np.isnan(hand).all(axis=1).nonzero()[0].tolist() == list(range(20, 25))


def test_a_semicolon_separates_columns_too(body, tmp_path):
    path = tmp_path / "reference.csv"
    write_vicon_csv(path, body)
    path.write_text(path.read_text(encoding="utf-8-sig").replace(",", ";"))
    found = read_reference(path).skeleton.positions
    np.testing.assert_allclose(found, body.positions, atol=1e-5)


@pytest.mark.parametrize("number", ["nan", "inf", "1e300", "-1e300", "third"])
def test_a_frame_of_vicon_with_an_invalid_number_is_refused(number, body, tmp_path):
    path = tmp_path / "reference.csv"
    write_vicon_csv(path, body)
    text = path.read_text(encoding="utf-8-sig")
    path.write_text(text.replace("\n103,0", f"\n{number},0"))
    with pytest.raises(InputError, match=r"frame number is invalid|third"):
        read_reference(path)


def write_mot(path, columns, times, in_degrees=True):
    """By OpenSim itself."""
    opensim = pytest.importorskip("opensim")
    table = opensim.TimeSeriesTable()
    table.setColumnLabels(list(columns))
    for time, row in zip(times, np.array(list(columns.values())).T, strict=True):
        table.appendRow(float(time), opensim.RowVector(row.tolist()))
    table.addTableMetaDataString("inDegrees", "yes" if in_degrees else "no")
    opensim.STOFileAdapter.write(table, str(path))


def coordinates(body):
    angles = {name: np.degrees(values) for name, values in joint_angles(body.positions).items()}
    columns = {}
    for side in ("left", "right"):
        columns[f"hip_flexion_{side[0]}"] = angles[f"{side}_hip_flexion"]
        columns[f"hip_adduction_{side[0]}"] = -angles[f"{side}_hip_abduction"]
        columns[f"knee_angle_{side[0]}"] = angles[f"{side}_knee_flexion"]
        columns[f"arm_flex_{side[0]}"] = angles[f"{side}_shoulder_flexion"]
        columns[f"arm_add_{side[0]}"] = -angles[f"{side}_shoulder_abduction"]
        columns[f"elbow_flex_{side[0]}"] = angles[f"{side}_elbow_flexion"]
    return columns


def test_opensim_s_angles_are_read_with_our_signs(tmp_path):
    body = motion(rate=RATE, duration_s=2.0)
    write_mot(tmp_path / "reference.mot", coordinates(body), body.stamps_ns * 1e-9)
    found = read_reference(tmp_path / "reference.mot")
    assert found.skeleton is None
    expected = joint_angles(body.positions)
    for name in ANGLES:
        np.testing.assert_allclose(found.angles.angles[name], expected[name], atol=1e-6)


MOT = """Coordinates
version=1
nRows=3
nColumns=3
inDegrees=yes
endheader
time\tknee_angle_l\thip_flexion_l
0.0\t{knee}\t10.0
0.1\t{knee}\t20.0
0.2\t{knee}\t30.0
"""


def test_knees_that_bend_to_negative_angles_are_reversed_with_a_note(tmp_path):
    path = tmp_path / "old_model.mot"
    path.write_text(MOT.format(knee=-40.0))
    found = read_reference(path)
    assert np.degrees(found.angles.angles["left_knee_flexion"]) == pytest.approx([40.0] * 3)
    assert np.degrees(found.angles.angles["left_hip_flexion"]) == pytest.approx([10, 20, 30])
    assert any("sign is reversed" in note for note in found.notes)


def test_an_angle_that_a_file_lacks_is_unknown(tmp_path):
    path = tmp_path / "legs.mot"
    path.write_text(MOT.format(knee=40.0))
    assert np.isnan(read_reference(path).angles.angles["right_elbow_flexion"]).all()


def test_radians_and_paths_of_newer_opensim_are_understood(tmp_path):
    path = tmp_path / "states.sto"
    text = MOT.format(knee=0.5).replace("inDegrees=yes", "inDegrees=no").replace("0.0\n", ".0\n")
    text = text.replace("knee_angle_l", "/jointset/walker_knee_l/knee_angle_l/value")
    path.write_text(text)
    assert read_reference(path).angles.angles["left_knee_flexion"] == pytest.approx([0.5] * 3)


def test_angles_in_another_unit_than_the_header_says_are_refused_or_noted(tmp_path):
    degrees, radians = tmp_path / "degrees.mot", tmp_path / "radians.mot"
    degrees.write_text(MOT.format(knee=40.0).replace("inDegrees=yes\n", ""))
    radians.write_text(MOT.format(knee=0.7).replace("0.0\n", ".0\n"))
    with pytest.raises(InputError, match=r"angle is 40\.0, in radians .*: write inDegrees=yes"):
        read_reference(degrees)
    note = "its largest angle is 3.00°: if its angles are in radians, write inDegrees=no"
    assert note in read_reference(radians).notes


BAD = {
    "nothing.trc": ("", "not a TRC file"),
    "nothing.csv": ("time,left_hip\n0,1\n", "section 'Trajectories'"),
    "nothing.c3d": ("not a C3D file at all, but long enough to be taken for one" * 20, "C3D"),
    "nothing.mot": ("time\tknee_angle_l\n0.0\t1.0\n", "endheader"),
    "words.mot": (MOT.format(knee="bent"), "line 8: could not convert"),
    "others.mot": (MOT.format(knee=1.0).replace("_l", "_of_a_horse"), "none of the angles"),
    "short.mot": (MOT.format(knee=1.0) + "0.3\t1.0\n", "line 11: expected 3 numbers"),
    "backwards.mot": (MOT.format(knee=1.0) + "0.1\t1.0\t1.0\n", "times do not increase"),
    "film.avi": ("", "expected a bag or one of"),
    "inches.csv": (
        "Trajectories\n100\n,,a:LASI,,\nFrame,Sub Frame,X,Y,Z\n,,in,in,in\n1,0,1,2,3\n",
        "unit 'in' is unknown",
    ),
    "rateless.csv": ("Trajectories\n\n100\n,,a:LASI,,\n1,0\n1,0\n", "the rate is nan Hz"),
    "someone_else_s.csv": (
        "Trajectories\n100\n,,a:TAIL,,\nFrame,Sub Frame,X,Y,Z\n,,mm,mm,mm\n1,0,1,2,3\n",
        "left_hip and right_hip and neck cannot be found.*found tail",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_a_file_that_is_none_is_refused_in_one_line(name, tmp_path):
    text, reason = BAD[name]
    (tmp_path / name).write_text(text)
    with pytest.raises(InputError, match=reason) as caught:
        read_reference(tmp_path / name)
    assert "\n" not in str(caught.value)
    assert name in str(caught.value)


def test_a_missing_reference_is_refused(tmp_path):
    with pytest.raises(InputError, match="found no reference at"):
        read_reference(tmp_path / "truth")


def test_a_binary_file_under_a_text_s_name_is_refused(tmp_path):
    (tmp_path / "film.trc").write_bytes(bytes(range(128, 256)))
    with pytest.raises(InputError, match="not a text file"):
        read_reference(tmp_path / "film.trc")
