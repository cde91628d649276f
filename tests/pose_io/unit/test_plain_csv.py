import gzip
from pathlib import Path

import numpy as np
import pytest

from pose_core.errors import InputError
from pose_core.joints import JOINT_INDEX, TrackingState
from pose_io.recordings.formats import plain_csv, read_recording, table
from pose_io.recordings.recording import make_recording, make_stream
from pose_io.recordings.timeline import make_timeline, order_lines

CSV = Path(__file__).parents[2] / "kinect_bridge" / "data" / "two_sensors.csv"


def edited(folder: Path, old: str, new: str) -> Path:
    text = CSV.read_text()
    assert old in text
    path = folder / "edited.csv"
    path.write_text(text.replace(old, new))
    return path


def test_a_file_is_read_as_written():
    recording = read_recording(CSV)

    left, right = recording.streams
    assert (left.name, right.name) == ("left", "right")
    assert recording.time_zero_ns == 100_000_000_000
    assert right.host_time_ns.tolist() == [100_040_000_000 + k * 100_000_000 for k in range(6)]
    assert left.sensor_time_ns.tolist() == [7_000_000_000 + k * 100_000_000 for k in range(6)]
    assert recording.comments == (
        "synthetic: two sensors, six frames each, made by hand for the tests",
    )
    np.testing.assert_allclose(left.positions[0, JOINT_INDEX["left_shoulder"]], [0.2, -0.35, 2.5])


def test_states_are_read_and_an_empty_cell_is_not_tracked():
    left = read_recording(CSV).streams[0]

    assert left.tracking_state[1, JOINT_INDEX["left_foot"]] == TrackingState.INFERRED
    assert left.tracking_state[2, JOINT_INDEX["right_hand"]] == TrackingState.NOT_TRACKED
    assert np.isnan(left.positions[2, JOINT_INDEX["right_hand"]]).all()
    assert left.joint_counts() == {"tracked": 73, "inferred": 1, "not_tracked": 1}


def test_an_empty_person_is_a_frame_without_persons():
    left = read_recording(CSV).streams[0]

    assert [len(left.rows(frame)) for frame in range(6)] == [1, 1, 1, 0, 1, 1]


def test_two_persons_in_a_frame_are_two_rows():
    right = read_recording(CSV).streams[1]

    assert [right.person[row] for row in right.rows(4)] == ["anna", "ben"]


def test_times_of_today_keep_their_nanoseconds(tmp_path):
    path = edited(tmp_path, "left,100.000,", "left,1763697600.123456789,")

    assert read_recording(path).streams[0].host_time_ns[0] == 1_763_697_600_123_456_789


def test_the_sensor_s_clock_may_be_absent(tmp_path):
    lines = [line.split(",") for line in CSV.read_text().splitlines()]
    path = tmp_path / "no_clock.csv"
    path.write_text("\n".join(",".join([*cells[:2], *cells[3:]]) for cells in lines[1:]))

    assert [stream.sensor_time_ns for stream in read_recording(path).streams] == [None, None]


def test_the_sensor_s_clock_may_be_empty(tmp_path):
    lines = [line.split(",") for line in CSV.read_text().splitlines()[1:]]
    path = tmp_path / "no_clock.csv"
    rows = [[*cells[:2], "", *cells[3:]] for cells in lines[1:]]
    path.write_text("\n".join(",".join(cells) for cells in [lines[0], *rows]))

    assert read_recording(path).streams[0].sensor_time_ns is None


def test_a_sensor_s_clock_with_holes_is_refused(tmp_path):
    path = edited(tmp_path, ",7.200,", ",,")

    with pytest.raises(InputError, match="line 7: column 'sensor_time_s' holds ''"):
        read_recording(path)


def test_a_state_beyond_tracked_is_refused(tmp_path):
    path = edited(tmp_path, "anna,0.000,-0.600,2.500,2", "anna,0.000,-0.600,2.500,3")

    with pytest.raises(InputError, match=r"line 3: column 'head_state' holds '3', expected 0 "):
        read_recording(path)


def test_joints_without_a_person_are_refused(tmp_path):
    path = edited(tmp_path, ",anna,0.000,", ",,0.000,")

    with pytest.raises(InputError, match="line 3: column 'person'"):
        read_recording(path)


def test_what_is_written_reads_the_same(tmp_path):
    recording = read_recording(CSV)
    path = tmp_path / "copy.csv"

    plain_csv.write(path, recording)
    copy = read_recording(path)

    assert copy.comments == recording.comments
    assert copy.time_zero_ns == recording.time_zero_ns
    for before, after in zip(recording.streams, copy.streams, strict=True):
        for name, value in vars(before).items():
            np.testing.assert_array_equal(getattr(after, name), value, err_msg=name)


def test_time_zero_is_kept(tmp_path):
    stream = make_stream(
        "left",
        host_time_ns=[-5, 1_000_000_123],
        sensor_time_ns=None,
        person=["", ""],
        positions=np.zeros((2, 15, 3)),
        tracking_state=np.zeros((2, 15), dtype=np.uint8),
    )
    path = tmp_path / "zero.csv"

    plain_csv.write(path, make_recording("made", "csv", [stream], time_zero_ns=-1_500_000_000))
    copy = read_recording(path)

    assert copy.time_zero_ns == -1_500_000_000
    assert copy.streams[0].host_time_ns.tolist() == [-5, 1_000_000_123]


def test_a_time_zero_that_is_no_time_is_refused(tmp_path):
    path = tmp_path / "zero.csv"
    path.write_text("# time_zero_s: noon\n" + CSV.read_text())

    with pytest.raises(InputError, match=r"line 1: .*noon"):
        read_recording(path)


def test_names_with_commas_survive(tmp_path):
    stream = make_stream(
        'sensor "a", left',
        host_time_ns=[0],
        sensor_time_ns=None,
        person=["Doe, Jane"],
        positions=np.ones((1, 15, 3)),
        tracking_state=np.full((1, 15), 2, dtype=np.uint8),
    )
    path = tmp_path / "names.csv"

    plain_csv.write(path, make_recording("made", "csv", [stream]))
    copy = read_recording(path).streams[0]

    assert (copy.name, copy.person) == ('sensor "a", left', ("Doe, Jane",))


def made(tmp_path, metres=1.0, seconds=1.0):
    """A file of a sensor at 30 Hz in other units."""
    stream = make_stream(
        "left",
        host_time_ns=[round(frame / 30.0 * seconds * 1e9) for frame in range(10)],
        sensor_time_ns=None,
        person=["anna"] * 10,
        positions=np.full((10, 15, 3), 1.4 * metres),
        tracking_state=np.full((10, 15), 2, dtype=np.uint8),
    )
    path = tmp_path / "units.csv"
    plain_csv.write(path, make_recording("made", "csv", [stream]))
    return path


@pytest.mark.parametrize("metres", [100.0, 1000.0])
def test_positions_in_centimetres_or_millimetres_are_refused(tmp_path, metres):
    with pytest.raises(InputError, match=r"m from sensor 'left'.*: write positions in metres"):
        read_recording(made(tmp_path, metres=metres))


@pytest.mark.parametrize("seconds", [1e3, 1e6])
def test_times_in_milliseconds_or_microseconds_are_refused(tmp_path, seconds):
    with pytest.raises(InputError, match=r"frames of sensor 'left'.*write host_time_s in seconds"):
        read_recording(made(tmp_path, seconds=seconds))


@pytest.mark.parametrize("separator", [";", "\t"])
def test_other_separators_are_named(tmp_path, separator):
    path = tmp_path / "spreadsheet.csv"
    path.write_text(made(tmp_path).read_text().replace(",", separator))
    with pytest.raises(InputError, match="columns separated by commas, decimal points"):
        read_recording(path)


@pytest.mark.parametrize("suffix", [".csv", ".csv.gz"])
def test_the_same_recording_gives_the_same_bytes(tmp_path, suffix):
    first, second = tmp_path / f"a{suffix}", tmp_path / f"b{suffix}"
    plain_csv.write(first, read_recording(CSV))
    plain_csv.write(second, read_recording(first))

    assert first.read_bytes() == second.read_bytes()


def test_gzip_holds_no_time_of_writing(tmp_path):
    path = tmp_path / "a.csv.gz"
    plain_csv.write(path, read_recording(CSV))

    assert path.read_bytes()[4:8] == bytes(4)  # RFC 1952: MTIME


def test_a_file_that_cannot_be_written_is_an_error(tmp_path):
    with pytest.raises(InputError, match="cannot write"):
        plain_csv.write(tmp_path / "no folder" / "x.csv", read_recording(CSV))


def test_a_time_beyond_all_bounds_is_a_bad_cell(tmp_path):
    for time in ("1e9999999", "-1e400", "1e999999999999999999"):
        path = edited(tmp_path, "left,100.000,", f"left,{time},")
        with pytest.raises(InputError, match="column 'host_time_s' holds"):
            read_recording(path)


def test_a_table_that_becomes_too_long_when_it_is_unpacked_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(table, "MAX_TABLE_BYTES", 1_000_000)
    path = tmp_path / "bomb.csv"
    header = CSV.read_bytes()
    path.write_bytes(gzip.compress(header + b"," * 50_000_000))

    with pytest.raises(InputError, match=r"has more than .* MB: split the recording"):
        read_recording(path)


def rows_of(tmp_path):
    """Header and rows of a file of ten frames at 30 Hz."""
    path = made(tmp_path)
    lines = path.read_text().splitlines(keepends=True)
    return path, lines[:2], lines[2:]


@pytest.mark.parametrize("order", [[*range(6, 10), *range(6)], range(9, -1, -1)])
def test_rows_that_are_not_in_the_order_of_time_are_sorted_and_counted(tmp_path, order):
    path, header, rows = rows_of(tmp_path)
    path.write_text("".join([*header, *(rows[row] for row in order)]))

    stream = read_recording(path).streams[0]
    timeline = make_timeline(stream)

    assert len(timeline) == 10
    assert timeline.counts["frames_reordered"] == stream.frames_sorted > 0
    (line,) = order_lines(stream, timeline)
    assert line.startswith(f"sensor left: {stream.frames_sorted} of 10 frames stood after later")


def test_rows_whose_rounded_times_are_equal_are_named(tmp_path):
    path, header, rows = rows_of(tmp_path)
    rounded = [row.replace(row.split(",")[1], f"{float(row.split(',')[1]):.1f}") for row in rows]
    path.write_text("".join([*header, *rounded]))

    stream = read_recording(path).streams[0]

    (line,) = order_lines(stream, make_timeline(stream))
    assert line.startswith("sensor left: 6 of 10 rows left out")
    assert "is the time column rounded?" in line


def test_times_in_whole_seconds_are_refused(tmp_path):
    path, header, rows = rows_of(tmp_path)
    in_seconds = [row.replace(row.split(",")[1], f"{k // 5}") for k, row in enumerate(rows)]
    path.write_text("".join([*header, *in_seconds]))

    with pytest.raises(InputError, match=r"8 of 10 rows .* host_time_s is rounded"):
        read_recording(path)
