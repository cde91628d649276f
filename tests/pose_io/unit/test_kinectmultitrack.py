from datetime import datetime, timezone

import numpy as np
import pytest

from pose_core.errors import InputError
from pose_core.joints import JOINT_INDEX, TrackingState
from pose_io.recordings.formats import read_recording
from pose_io.recordings.formats.kinectmultitrack import JOINT_COLUMNS, RENAMED
from pose_io.recordings.joint_map_files import shipped_joint_map

BEGIN = (
    "Study, KinectConfig, Scenario, Tracker_Time, Person#, Skeleton#, Skeleton_Time, "
    "Skeleton_Init_Angle, Skeleton_Init_Dist, Kinect#, Kinect_Tilt_Angle, Kinect_Height"
)
HEADER = BEGIN + ", " + ", ".join(sorted(JOINT_COLUMNS))
YEAR_1_MS = 63_562_205_247_984  # 2015-03-17 16:07:27.984


def row(tracker_ms=YEAR_1_MS, skeleton=636_645_975_903, person=0, kinect="10.0.0.1", **joints):
    """A row in which the joint with SDK index i stands at (i, 10 i, 100 i) unless given."""
    cells = {}
    for i, joint in enumerate(shipped_joint_map("kinect_v2").joints):
        for axis, value in zip("XYZ", joints.get(joint, (i, 10 * i, 100 * i)), strict=True):
            cells[f"{joint}_{axis}"] = value
    first = f"10, 0, 1, {tracker_ms}, {person}, 0, {skeleton}, -0.09, 2.39, {kinect}, 0, 100"
    return first + "".join(f", {cells[name]}" for name in sorted(JOINT_COLUMNS))


@pytest.fixture
def read(tmp_path):
    def read(*rows, header=HEADER):
        path = tmp_path / "recording.csv"
        path.write_text("\n".join([header, *rows]) + "\n")
        return read_recording(path)

    return read


def test_the_server_s_clock_becomes_unix_time(read):
    expected = datetime(2015, 3, 17, 16, 7, 27, 984_000, tzinfo=timezone.utc)

    stream = read(row()).streams[0]

    assert stream.host_time_ns[0] == round(expected.timestamp() * 1000) * 1_000_000


def test_the_camera_s_clock_ticks_in_100_ns(read):
    assert read(row(skeleton=12)).streams[0].sensor_time_ns.tolist() == [1200]


def test_camera_space_becomes_the_optical_frame(read):
    stream = read(row(WristLeft=(0.1, 0.2, 2.0))).streams[0]

    np.testing.assert_allclose(stream.positions[0, JOINT_INDEX["left_hand"]], [-0.1, -0.2, 2.0])
    assert (stream.tracking_state == TrackingState.TRACKED).all()


def test_minus_9999_is_missing(read):
    stream = read(row(KneeRight=(-9999, -9999, -9999))).streams[0]

    assert np.isnan(stream.positions[0, JOINT_INDEX["right_knee"]]).all()
    assert stream.joint_counts() == {"tracked": 14, "inferred": 0, "not_tracked": 1}


@pytest.mark.parametrize("value", ["nan", "inf", ""])
def test_what_is_no_finite_number_is_missing(read, value):
    stream = read(row(KneeRight=(value, 0, 0))).streams[0]

    assert stream.joint_counts()["not_tracked"] == 1


def test_the_address_names_the_sensor_in_order_of_appearance(read):
    recording = read(row(kinect="10.0.0.9"), row(kinect="10.0.0.1"), row(kinect="10.0.0.9"))

    assert [stream.name for stream in recording.streams] == ["10.0.0.9", "10.0.0.1"]


def test_two_persons_of_a_tick_are_one_frame(read):
    stream = read(row(person=0), row(person=1)).streams[0]

    assert len(stream) == 1
    assert stream.persons == ("0", "1")


def test_the_later_naming_of_the_columns_is_read_too(read):
    later = HEADER
    for new, old in RENAMED.items():
        later = later.replace(f"{old},", f"{new},")
    assert later != HEADER

    assert read(row(), header=later).streams[0].name == "10.0.0.1"


def test_a_missing_joint_column_is_refused(read):
    with pytest.raises(InputError, match="the header lacks column 'WristRight_Z'"):
        read(row().rsplit(",", 1)[0], header=HEADER.rsplit(",", 1)[0])


def test_an_unknown_column_is_refused(read):
    with pytest.raises(InputError, match="unknown column 'Mood'"):
        read(row() + ", 1", header=HEADER + ", Mood")


def test_a_bad_cell_is_refused_with_line_and_column(read):
    with pytest.raises(InputError, match="line 3: column 'Head_Y' holds 'tall'"):
        read(row(), row(Head=(0, "tall", 0)))
