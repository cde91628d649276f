"""Errors of every format: one line with file, line and remedy."""

import gzip
from pathlib import Path

import pytest

from pose_core.errors import InputError
from pose_io.recordings.formats import FORMATS, detect_format, read_recording

CSV = Path(__file__).parents[2] / "kinect_bridge" / "data" / "two_sensors.csv"
LINES = CSV.read_text().splitlines()
HEADER, FIRST_ROW = 1, 2  # indices into LINES


def write(folder: Path, lines: list[str]) -> Path:
    path = folder / "recording.csv"
    path.write_text("\n".join(lines) + "\n")
    return path


def refusal(path: Path, format_name: str = "auto") -> str:
    with pytest.raises(InputError) as error:
        read_recording(path, format_name)
    message = str(error.value)
    assert "\n" not in message
    return message


def test_a_format_is_recognised_by_its_header():
    assert detect_format(CSV) == "csv"


def test_no_two_formats_share_their_key_columns():
    keys = [format_.key_columns for format_ in FORMATS.values() if format_.key_columns]
    assert not keys[0] & keys[1]


def test_gzip_is_read_whatever_the_name(tmp_path):
    path = tmp_path / "recording"
    path.write_bytes(gzip.compress(CSV.read_bytes()))

    assert len(read_recording(path).streams) == 2


def test_a_byte_order_mark_and_windows_line_ends_do_no_harm(tmp_path):
    path = tmp_path / "recording.csv"
    path.write_bytes(b"\xef\xbb\xbf" + "\r\n".join(LINES).encode())

    assert [len(stream) for stream in read_recording(path).streams] == [6, 6]


def test_a_missing_file_is_refused(tmp_path):
    assert "found no file" in refusal(tmp_path / "nothing.csv")


def test_a_folder_is_refused(tmp_path):
    assert "cannot read" in refusal(tmp_path)


def test_an_empty_file_is_refused(tmp_path):
    path = tmp_path / "empty.csv"
    path.touch()
    assert "is empty" in refusal(path)


def test_a_header_alone_is_refused(tmp_path):
    assert "holds no frames" in refusal(write(tmp_path, LINES[: HEADER + 1]))


def test_a_binary_file_is_refused(tmp_path):
    path = tmp_path / "picture.png"
    path.write_bytes(b"\x89PNG\r\n\x1a\n\xff\xfe\x00")
    assert "not a text table" in refusal(path)


def test_gzip_cut_short_is_refused(tmp_path):
    path = tmp_path / "recording.csv.gz"
    path.write_bytes(gzip.compress(CSV.read_bytes())[:-200])
    assert "cut short" in refusal(path)


def test_gzip_damaged_is_refused(tmp_path):
    data = bytearray(gzip.compress(CSV.read_bytes()))
    data[60] ^= 0xFF
    path = tmp_path / "recording.csv.gz"
    path.write_bytes(data)
    assert "gzip" in refusal(path)


def test_another_table_is_refused_with_the_formats_there_are(tmp_path):
    message = refusal(write(tmp_path, ["time,heart_rate", "1,60"]))
    assert "time, heart_rate" in message
    assert "kinectmultitrack" in message


def test_an_unknown_column_is_refused_by_name(tmp_path):
    lines = LINES.copy()
    lines[HEADER] = lines[HEADER].replace("left_hand_x", "left_wrist_x")
    message = refusal(write(tmp_path, lines))
    assert "line 2: unknown column 'left_wrist_x'" in message


def test_a_missing_column_is_refused_by_name(tmp_path):
    lines = [line.rsplit(",", 1)[0] for line in LINES]
    assert "line 2: the header lacks column 'right_foot_state'" in refusal(write(tmp_path, lines))


def test_a_column_twice_is_refused(tmp_path):
    lines = [LINES[0], LINES[HEADER] + ",person", *(line + "," for line in LINES[FIRST_ROW:])]
    assert "'person' occurs twice" in refusal(write(tmp_path, lines))


def test_a_ragged_row_is_refused_with_its_line(tmp_path):
    lines = LINES.copy()
    lines[FIRST_ROW + 1] += ",1"
    message = refusal(write(tmp_path, lines))
    assert "line 4: the row has 65 cells, the header 64" in message


@pytest.mark.parametrize("column", ["host_time_s", "sensor_time_s", "neck_y", "neck_state"])
def test_a_cell_that_is_no_number_is_refused_with_line_and_column(tmp_path, column):
    cells = LINES[FIRST_ROW].split(",")
    cells[LINES[HEADER].split(",").index(column)] = "abc"
    message = refusal(write(tmp_path, [*LINES[:FIRST_ROW], ",".join(cells)]))
    assert f"line 3: column '{column}' holds 'abc'" in message


@pytest.mark.parametrize("time", ["nan", "inf", "1e40", ""])
def test_a_time_that_is_none_is_refused(tmp_path, time):
    cells = LINES[FIRST_ROW].split(",")
    cells[1] = time
    assert "column 'host_time_s'" in refusal(write(tmp_path, [*LINES[:2], ",".join(cells)]))


def test_a_format_given_by_name_names_missing_columns():
    assert "line 2: unknown columns 'sensor'" in refusal(CSV, "kinectmultitrack")
