import gzip

import numpy as np
import pytest

from pose_core.errors import InputError
from pose_core.joints import JOINT_INDEX
from pose_io.recordings.formats import read_recording
from pose_io.recordings.formats.uiprmd import PARENTS, angles_path, joint_places

NAMES = list(PARENTS)


def standing(frames=3):
    """Offsets [cm] of somebody who stands 2 m before the sensor, arms hanging."""
    offsets = np.zeros((frames, len(NAMES), 3))
    for name, offset in {
        "Waist": (0, 90, -200),
        "Spine": (0, 25, 0),
        "Chest": (0, 25, 0),
        "HeadTip": (0, 20, 0),
        "LUpperArm": (17, 0, 0),
        "LForearm": (0, -28, 0),
        "LHand": (0, -25, 0),
        "RUpperArm": (-17, 0, 0),
        "RForearm": (0, -28, 0),
        "RHand": (0, -25, 0),
        "LUpperLeg": (8, 0, 0),
        "LLowerLeg": (0, -40, 0),
        "LFoot": (0, -40, 0),
        "RUpperLeg": (-8, 0, 0),
        "RLowerLeg": (0, -40, 0),
        "RFoot": (0, -40, 0),
    }.items():
        offsets[:, NAMES.index(name)] = offset
    return offsets


def write(folder, offsets, angles, suffix=""):
    for name, values in (("positions", offsets), ("angles", angles)):
        lines = "\n".join(",".join(f"{v:.6f}" for v in row) for row in values.reshape(-1, 66))
        data = lines.encode()
        path = folder / f"m01_s01_e01_{name}.txt{suffix}"
        path.write_bytes(gzip.compress(data) if suffix else data)
    return folder / f"m01_s01_e01_positions.txt{suffix}"


@pytest.mark.parametrize("suffix", ["", ".gz"])
def test_a_standing_person_faces_the_sensor_in_the_optical_frame(tmp_path, suffix):
    path = write(tmp_path, standing(), np.zeros((3, 22, 3)), suffix)

    stream = read_recording(path, "uiprmd").streams[0]

    joints = stream.positions[0]
    assert joints[JOINT_INDEX["left_hip"]] == pytest.approx((0.08, -0.9, 2.0))
    assert joints[JOINT_INDEX["right_foot"]] == pytest.approx((-0.08, -0.1, 2.0))
    assert joints[JOINT_INDEX["neck"]] == pytest.approx((0.0, -1.4, 2.0))
    assert np.diff(stream.host_time_ns) == pytest.approx(1e9 / 30.0, abs=1.0)


def test_a_joints_rotation_moves_what_hangs_on_it():
    angles = np.zeros((1, 22, 3))
    angles[:, NAMES.index("LUpperLeg")] = (-90.0, 0.0, 0.0)

    places = joint_places(standing(1), angles)

    # Lifted to the front, towards the sensor, the thigh carries the shank along.
    assert places[0, NAMES.index("LLowerLeg")] == pytest.approx((8.0, 90.0, -160.0))
    assert places[0, NAMES.index("LFoot")] == pytest.approx((8.0, 90.0, -120.0))
    assert places[0, NAMES.index("RFoot")] == pytest.approx((-8.0, 10.0, -200.0))


def test_angles_are_found_beside_the_positions_or_beside_their_folder(tmp_path):
    assert angles_path(tmp_path / "a_positions.txt") == tmp_path / "a_angles.txt"
    in_folder = tmp_path / "Positions" / "a_positions.txt.gz"
    assert angles_path(in_folder) == tmp_path / "Angles" / "a_angles.txt.gz"


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("a_positions.txt", "1,2,3\n", "has 3 columns, expected 66"),
        ("a_positions.txt", "a,b\n", "is not a table of numbers"),
        ("a_positions.txt", ",".join(["nan"] * 66), "holds NaN"),
        ("a.txt", ",".join(["1"] * 66), "is not named"),
    ],
)
def test_a_file_that_is_something_else_is_refused_in_one_line(tmp_path, name, text, message):
    path = tmp_path / name
    path.write_text(text)

    with pytest.raises(InputError, match=message) as error:
        read_recording(path, "uiprmd")
    assert "\n" not in str(error.value)


def test_files_of_two_lengths_are_refused(tmp_path):
    path = write(tmp_path, standing(), np.zeros((3, 22, 3)))
    rows = (tmp_path / "m01_s01_e01_angles.txt").read_text().splitlines()
    (tmp_path / "m01_s01_e01_angles.txt").write_text("\n".join(rows[:2]))

    with pytest.raises(InputError, match=r"has 3 frames, .* 2: expected two files"):
        read_recording(path, "uiprmd")


@pytest.mark.data
def test_feet_of_a_real_squat_stay_on_the_floor(shared_data):
    folder = shared_data / "uiprmd" / "Kinect" / "Positions"
    stream = read_recording(folder / "m01_s03_e05_positions.txt.gz", "uiprmd").streams[0]

    height = stream.positions[..., 1]
    for side in ("left", "right"):
        hip, foot = (height[:, JOINT_INDEX[f"{side}_{joint}"]] for joint in ("hip", "foot"))
        assert np.ptp(hip) > 0.3
        assert foot.std() < 0.06
