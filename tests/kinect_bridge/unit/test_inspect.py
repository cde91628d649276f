import json
import sys
from pathlib import Path

import pytest

from kinect_bridge.tools import inspect

CSV = Path(__file__).parents[2] / "kinect_bridge" / "data" / "two_sensors.csv"


def run(monkeypatch, *arguments) -> int:
    monkeypatch.setattr(sys, "argv", ["inspect", *map(str, arguments)])
    with pytest.raises(SystemExit) as end:
        inspect.main()
    return end.value.code


def test_json_has_the_content_of_the_file(monkeypatch, capsys):
    assert run(monkeypatch, CSV, "--json") == 0
    found = json.loads(capsys.readouterr().out)

    assert found["format"] == "csv"
    assert found["persons"] == ["anna", "ben"]
    assert found["duration_s"] == pytest.approx(0.54, abs=1e-3)
    assert [sensor["name"] for sensor in found["sensors"]] == ["left", "right"]
    assert [sensor["frames"] for sensor in found["sensors"]] == [6, 6]
    assert found["sensors"][0]["joints"] == {"tracked": 73, "inferred": 1, "not_tracked": 1}
    assert found["sensors"][0]["gaps"] == []


def test_the_text_has_sensors_frames_and_comments(monkeypatch, capsys):
    assert run(monkeypatch, CSV, "--print-only") == 0
    text = capsys.readouterr().out

    assert "# synthetic: " in text
    assert "sensor 1: right" in text
    assert "6 of 6, 10.0 Hz" in text


def test_the_first_frame_is_drawn_too(monkeypatch, capsys, tmp_path):
    monkeypatch.chdir(tmp_path)

    assert run(monkeypatch, CSV) == 0

    assert "first frame: two_sensors.png" in capsys.readouterr().out
    assert (tmp_path / "two_sensors.png").read_bytes().startswith(b"\x89PNG")


def test_the_picture_goes_where_it_is_wanted_or_nowhere(monkeypatch, capsys, tmp_path):
    monkeypatch.chdir(tmp_path)
    wanted = tmp_path / "wanted.png"

    assert run(monkeypatch, CSV, "--figure", wanted) == 0
    assert run(monkeypatch, CSV, "--print-only") == 0
    assert run(monkeypatch, CSV, "--json") == 0
    assert [path.name for path in tmp_path.iterdir()] == ["wanted.png"]


def test_a_picture_that_cannot_be_written_is_one_line(monkeypatch, capsys, tmp_path):
    assert run(monkeypatch, CSV, "--figure", tmp_path / "no" / "folder.png") == 1

    assert "cannot write" in capsys.readouterr().err


def test_a_gap_is_reported_with_place_and_length(monkeypatch, capsys, tmp_path):
    path = tmp_path / "gap.csv"
    path.write_text(CSV.read_text().replace("left,100.500,7.500", "left,112.500,19.500"))

    assert run(monkeypatch, path, "--json") == 0
    (gap,) = json.loads(capsys.readouterr().out)["sensors"][0]["gaps"]

    assert gap["at_s"] == pytest.approx(0.4, abs=2e-3)
    assert gap["length_s"] == pytest.approx(12.1, abs=5e-3)


def test_when_frames_show_nobody_is_reported_with_place_and_length(monkeypatch, capsys, tmp_path):
    body = ["1", "1 0 1 1 1 1 0 0.02 -0.19 2", "25", *["0.1 0.2 2" + " 0" * 8 + " 2"] * 25]
    frames = [["0"] if 30 <= frame < 90 else body for frame in range(120)]
    path = tmp_path / "absence.skeleton"
    path.write_text("\n".join(["120", *(line for frame in frames for line in frame)]))

    assert run(monkeypatch, path, "--json") == 0
    (sensor,) = json.loads(capsys.readouterr().out)["sensors"]
    (absence,) = sensor["absences"]

    assert sensor["gaps"] == []
    assert absence["at_s"] == pytest.approx(1.0, abs=2e-3)
    assert absence["length_s"] == pytest.approx(2.0, abs=2e-3)
    assert run(monkeypatch, path, "--print-only") == 0
    assert "nobody   2.0 s at 1.0 s" in capsys.readouterr().out


def test_a_missing_file_is_one_line_and_status_1(monkeypatch, capsys, tmp_path):
    assert run(monkeypatch, tmp_path / "nothing.csv") == 1
    said = capsys.readouterr()

    assert said.out == ""
    assert said.err.startswith("error: found no file")
    assert said.err.count("\n") == 1


def test_coordinates_that_no_camera_can_give_are_called_out(monkeypatch, capsys, tmp_path):
    monkeypatch.chdir(tmp_path)
    rows = CSV.read_text().splitlines()
    at = next(index for index, row in enumerate(rows) if row and row[0] != "#") + 1
    header = rows[at - 1].split(",")
    cells = rows[at].split(",")
    column = next(i for i, name in enumerate(header) if name.endswith("_x") and cells[i])
    cells[column] = "1e30"
    rows[at] = ",".join(cells)
    (tmp_path / "far.csv").write_text("\n".join(rows) + "\n")

    assert run(monkeypatch, tmp_path / "far.csv") == 0
    assert "ABSURD   1 joints are more than 100 m away, the farthest 1e+30 m" in (
        capsys.readouterr().out
    )


def test_rows_with_the_time_of_another_are_named_with_the_likely_cause(
    monkeypatch, capsys, tmp_path
):
    path = tmp_path / "rounded.csv"
    path.write_text(CSV.read_text().replace("left,100.100,7.100", "left,100.000,7.000"))

    assert run(monkeypatch, path, "--print-only") == 0

    assert "ORDER    1 of 5 rows left out" in capsys.readouterr().out
