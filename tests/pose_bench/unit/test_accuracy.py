from dataclasses import replace

import numpy as np
import pytest

from pose_bench import accuracy
from pose_bench.methods import METHODS, available_methods, run_method
from pose_bench.pool import run_all
from pose_bench.suite import CALIBRATED, KNOWN, Cell
from pose_bench.tools import accuracy as accuracy_tool
from pose_bench.tools import bench
from pose_core.errors import InputError

CELL = Cell(choreography="squats", level="easy", seed=5, condition=KNOWN, duration_s=20.0)


def methods(*names):
    return [method for method in METHODS if method.name in names]


def test_the_baseline_and_the_raw_sensors_are_there():
    assert {"left", "right", "mean", "joint_kf", "dof_kf", "li2020"} <= {
        method.name for method in available_methods()
    }


def test_a_kalman_filter_of_both_sensors_beats_each_of_them():
    left, right, both = accuracy.run_cell(CELL, methods("left", "right", "joint_kf"))

    assert both.error == ""
    assert both.rmse_deg < min(left.rmse_deg, right.rmse_deg)
    assert both.instants > 0.98
    assert abs(left.added_lag_ms) < 2.0


def test_a_session_without_calibration_is_reported_and_the_baseline_still_runs():
    short = replace(CELL, condition=CALIBRATED)

    def refuse(*_):
        raise InputError("nobody moves")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(accuracy, "calibrate", refuse)
        mean, baseline = accuracy.run_cell(short, methods("mean", "joint_kf"))

    assert mean.error == "not calibrated: nobody moves"
    assert baseline.error == ""
    assert baseline.rmse_deg < 15.0


def test_a_method_that_fails_has_a_row_with_the_reason(monkeypatch):
    def broken(method, *arguments):
        if method.name == "mean":
            raise np.linalg.LinAlgError("singular\nmatrix")
        return run_method(method, *arguments)

    monkeypatch.setattr(accuracy, "run_method", broken)
    left, mean = accuracy.run_cell(CELL, methods("left", "mean"))

    assert left.error == ""
    assert mean.error == "LinAlgError: singular"


def test_results_keep_the_order_of_the_arguments_in_several_processes():
    told = []
    powers = run_all(
        pow, [(2, n) for n in range(6)], jobs=2, progress=lambda *count: told.append(count)
    )

    assert powers == [1, 2, 4, 8, 16, 32]
    assert told == [(n, 6) for n in range(7)]


def test_the_tool_writes_the_table_and_the_csv(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(accuracy_tool, "quick_cells", lambda: [CELL])
    arguments = ["accuracy", "--quick", "--methods", "left", "joint_kf", "--jobs", "1"]

    status = bench.run([*arguments, "-o", str(tmp_path / "out")])

    assert status == 0
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"accuracy.md", "accuracy.csv"}
    assert "| joint_kf | 1.00 |" in (tmp_path / "out" / "accuracy.md").read_text()
    printed = capsys.readouterr()
    assert "RMSE ratio" in printed.out
    assert "left out: UI-PRMD" in printed.err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--jobs", "0"], "jobs = 0: expected 1 or more"),
        (["--seeds", "-1"], "none may be negative"),
        (["--choreographies", "polka"], "unknown choreography 'polka'"),
        (["--only-real", "--uiprmd", "/nonexistent"], "found no repetition of UI-PRMD"),
        (["--only-real", "--kinectmultitrack", "/nonexistent"], "found no KinectMultiTrack"),
    ],
)
def test_bad_arguments_end_in_one_line(arguments, message):
    with pytest.raises(InputError, match=message) as error:
        bench.run(["accuracy", *arguments])
    assert "\n" not in str(error.value)
