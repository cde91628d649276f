"""Files of single sensors: Azure Kinect's CSV and JSON, NTU's skeletons, UTD-MHAD's."""

import gzip
import json
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from pose_core.errors import InputError
from pose_core.joints import JOINT_INDEX, JOINTS
from pose_io.recordings.formats import detect_format, read_recording
from pose_io.recordings.joint_map_files import shipped_joint_map

AZURE, KINECT_V2 = shipped_joint_map("azure_kinect"), shipped_joint_map("kinect_v2")


def joints_of(count: int, frame: int) -> np.ndarray:
    """Places that name themselves: joint i of frame f at (i, f, 2) in the source's unit."""
    return np.column_stack([np.arange(count), np.full(count, frame), np.full(count, 2)]).astype(
        float
    )


def refusal(path: Path, format_name: str = "auto") -> str:
    with pytest.raises(InputError) as error:
        read_recording(path, format_name)
    assert "\n" not in str(error.value)
    return str(error.value)


def azure_csv(folder: Path, level: int = 2) -> Path:
    header = ["timestamp", "body_idx"]
    header += [f"{joint} ({value})" for joint in AZURE.joints for value in "cxyz"]
    lines = [";".join(header)]
    for frame in range(3):
        cells = [f"{level};{x};{y};{z}" for x, y, z in joints_of(32, frame)]
        lines.append(f"{200_000 + 33_333 * frame};1;{';'.join(cells)}")
    path = folder / "positions.csv"
    path.write_text("\n".join(lines) + "\n")
    return path


def azure_document(**body) -> dict:
    frames = [
        {
            "timestamp_usec": 1_000_000 + 33_333 * frame,
            "bodies": [{"body_id": 4, "joint_positions": joints_of(32, frame).tolist(), **body}],
        }
        for frame in range(3)
    ]
    frames.append({"timestamp_usec": 2_000_000, "bodies": []})
    return {"joint_names": list(AZURE.joints), "bone_list": [], "frames": frames}


def azure_json(folder: Path, **body) -> Path:
    path = folder / "bodies.json"
    path.write_text(json.dumps(azure_document(**body)))
    return path


def ntu(folder: Path, state: int = 2) -> Path:
    lines = ["3"]
    for frame in range(2):
        lines += ["1", "72057594037931101 0 1 1 1 1 0 0.02 -0.19 2", "25"]
        lines += [
            f"{x} {y} {z} 277.4 191.8 1036.2 519.1 0.9 0.1 0.2 0.3 {state}"
            for x, y, z in joints_of(25, frame)
        ]
    path = folder / "S001C001P001R001A001.skeleton"
    path.write_text("\n".join([*lines, "0"]) + "\n")
    return path


def utd_mhad(folder: Path) -> Path:
    path = folder / "a1_s1_t1_skeleton.mat"
    savemat(path, {"d_skel": np.stack([joints_of(20, f) for f in range(3)], axis=-1)})
    return path


MAKERS = {"azure_csv": azure_csv, "azure_json": azure_json, "ntu": ntu, "utd_mhad": utd_mhad}


@pytest.mark.parametrize("name", MAKERS)
def test_a_format_is_recognised_by_its_beginning_for_any_name(tmp_path, name):
    path = MAKERS[name](tmp_path).rename(tmp_path / "recording")

    assert detect_format(path) == name


@pytest.mark.parametrize("name", MAKERS)
def test_gzip_is_read_in_every_format(tmp_path, name):
    path = MAKERS[name](tmp_path)
    packed = tmp_path / "packed"
    packed.write_bytes(gzip.compress(path.read_bytes()))

    assert len(read_recording(packed).streams[0]) >= 3


@pytest.mark.parametrize(
    ("name", "map_name", "joint"),
    [
        ("azure_csv", "azure_kinect", "ELBOW_LEFT"),
        ("azure_json", "azure_kinect", "ELBOW_LEFT"),
        ("ntu", "kinect_v2", "ElbowLeft"),
        ("utd_mhad", "utd_mhad", "ElbowLeft"),
    ],
)
def test_joints_are_mapped_to_metres_in_the_optical_frame(tmp_path, name, map_name, joint):
    (stream,) = read_recording(MAKERS[name](tmp_path)).streams
    joint_map = shipped_joint_map(map_name)

    place = [joint_map.index[joint], 1.0, 2.0]
    expected = joint_map.unit_m * joint_map.R_optical_sdk @ place
    np.testing.assert_allclose(stream.positions[1, JOINT_INDEX["left_elbow"]], expected)
    assert (np.diff(stream.host_time_ns[:2]) // 1000 == [33_333]).all()


@pytest.mark.parametrize(("level", "state"), [(0, 0), (1, 1), (2, 2), (3, 2)])
def test_azure_s_confidence_levels_become_states(tmp_path, level, state):
    (stream,) = read_recording(azure_csv(tmp_path, level)).streams
    assert (stream.tracking_state == state).all()

    (stream,) = read_recording(azure_json(tmp_path, confidence_levels=[level] * 32)).streams
    assert (stream.tracking_state == state).all()
    (stream,) = read_recording(azure_json(tmp_path, joint_confidence=[[level]] * 32)).streams
    assert (stream.tracking_state == state).all()


@pytest.mark.parametrize("state", [0, 1, 2])
def test_ntu_s_tracking_states_are_kept(tmp_path, state):
    (stream,) = read_recording(ntu(tmp_path, state)).streams

    assert (stream.tracking_state == state).all()
    assert stream.persons == ("72057594037931101",)


@pytest.mark.parametrize("name", ["azure_json", "ntu"])
def test_a_frame_without_bodies_has_no_persons(tmp_path, name):
    (stream,) = read_recording(MAKERS[name](tmp_path)).streams

    assert len(stream.rows(len(stream) - 1)) == 0


@pytest.mark.parametrize("missing", [0.0, np.nan])
def test_a_body_of_zeros_or_without_a_number_is_nobody(tmp_path, missing):
    joints = np.stack([joints_of(20, f) for f in range(3)], axis=-1)
    joints[..., 1] = missing
    savemat(tmp_path / "a1_s1_t1_skeleton.mat", {"d_skel": joints})
    (stream,) = read_recording(tmp_path / "a1_s1_t1_skeleton.mat").streams

    assert [len(stream.rows(frame)) for frame in range(len(stream))] == [1, 0, 1]


def test_a_folder_with_a_file_a_frame_is_a_recording(tmp_path):
    for frame in range(3):
        joints = np.column_stack([joints_of(32, frame), np.zeros((32, 4))]).tolist()
        name = f"sk_{1_588_682_842 + frame}_{10_000_000 + 66_667 * frame}.txt"
        (tmp_path / name).write_text(json.dumps(joints))
    (tmp_path / "notes.md").write_text("no frame")

    recording = read_recording(tmp_path)

    assert recording.format == "azure_json"
    (stream,) = recording.streams
    assert stream.host_time_ns[0] == 1_588_682_842_000_000_000
    assert np.diff(stream.host_time_ns).tolist() == [66_667_000] * 2


def test_missing_places_of_json_are_missing_joints(tmp_path):
    joints = joints_of(32, 0).tolist()
    joints[AZURE.index["ELBOW_LEFT"]] = [None, None, None]
    document = azure_document(joint_positions=joints)
    path = tmp_path / "bodies.json"
    path.write_text(json.dumps(document))

    (stream,) = read_recording(path).streams

    assert stream.tracking_state[0, JOINT_INDEX["left_elbow"]] == 0
    assert stream.tracking_state[0].sum() == 2 * (len(JOINTS) - 1)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"{}", "is not an Azure Kinect's JSON"),
        (b'{"frames": 3}', "is not an Azure Kinect's JSON"),
        (b'{"frames": []}', "holds no frames"),
        (b'{"frames": [{"bodies": []}]}', "frame 0 has the time None"),
        (b'{"frames":' + b"[" * 100_000, "is not an Azure Kinect's JSON"),
        (
            b'{"frames":[{"timestamp_usec":1,"bodies":[{"body_id":1,"joint_positions":[[1,2,3]]}]}]}',
            "frame 0 has 1 joints",
        ),
    ],
)
def test_json_that_holds_something_else_is_refused(tmp_path, content, said):
    path = tmp_path / "bodies.json"
    path.write_bytes(content)
    assert said in refusal(path)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda lines: lines[:40], "line"),
        (lambda lines: ["x", *lines[1:]], "line 1: found 'x', expected the number of frames"),
        (lambda lines: [lines[0], "900", *lines[2:]], "line 2: found '900'"),
        (lambda lines: [*lines[:3], "20", *lines[4:]], "line 4: found fewer joints"),
        (lambda lines: [*lines[:4], "a " * 12, *lines[5:]], "line 5: found 'a a"),
    ],
)
def test_a_damaged_skeleton_file_is_refused_with_its_line(tmp_path, change, said):
    path = ntu(tmp_path)
    path.write_text("\n".join(change(path.read_text().splitlines())))

    assert said in refusal(path)


def test_a_mat_file_of_the_inertial_sensor_is_refused(tmp_path):
    path = tmp_path / "a1_s1_t1_inertial.mat"
    savemat(path, {"d_iner": np.zeros((10, 6))})

    assert "has no 'd_skel'" in refusal(path)


def test_a_mat_file_that_is_cut_short_is_refused(tmp_path):
    path = utd_mhad(tmp_path)
    path.write_bytes(path.read_bytes()[:200])

    assert "damaged .mat" in refusal(path)


@pytest.mark.data
@pytest.mark.parametrize("motion", ["walking", "squatting", "3d_hand_movement"])
def test_people_before_a_real_azure_kinect_are_as_long_as_people_are(shared_data, motion):
    path = shared_data / "azure_imu" / f"{motion}_positions_3d.csv.gz"

    (stream,) = read_recording(path).streams

    hip, knee = (stream.positions[:, JOINT_INDEX[f"left_{name}"]] for name in ("hip", "knee"))
    assert 0.35 < np.nanmedian(np.linalg.norm(knee - hip, axis=1)) < 0.5
    assert np.median(np.diff(stream.host_time_ns)) == pytest.approx(33.3e6, rel=0.01)
