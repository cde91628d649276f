import csv
import io

import numpy as np
import pytest
from moving_body import motion
from rich.console import Console

from pose_core.joints import JOINT_INDEX
from pose_evaluation.agreement import measure_agreement, measure_stability
from pose_evaluation.scores import evaluate
from pose_evaluation.tables import (
    agreement_csv,
    evaluation_csv,
    evaluation_table,
    stability_table,
    view_tables,
)
from pose_io.references.reference import reference_of_skeleton


@pytest.fixture
def evaluation():
    wrong = motion(rate=30.0)
    wrong.positions[:, JOINT_INDEX["left_foot"], 0] += 0.1
    methods = {"left": wrong, "fused": motion(rate=30.0)}
    return evaluate(methods, reference_of_skeleton("the truth", motion(), synthetic=True))


def shown(*tables, width=80):
    console = Console(file=io.StringIO(), width=width, color_system=None)
    for table in tables:
        console.print(table.terminal())
    return console.file.getvalue()


def stability_of(methods):
    return {name: measure_stability(series) for name, series in methods.items()}


def agreement_tables(methods, T_map_sensor):
    views = measure_agreement(methods, T_map_sensor)
    return [*view_tables(views), stability_table(stability_of(methods))]


def rows(text):
    return list(csv.DictReader(io.StringIO(text)))


def test_the_table_says_that_the_subject_is_synthetic(evaluation):
    assert "simulated sensors" in " ".join(shown(evaluation_table(evaluation)).split())
    assert "simulated sensors" in evaluation_table(evaluation).markdown()
    assert {row["reference"] for row in rows(evaluation_csv(evaluation))} == {
        "the truth, simulated sensors"
    }


def test_four_methods_fit_into_eighty_columns(evaluation):
    methods = {name: motion(rate=30.0) for name in ("left", "right", "mean", "fused")}
    table = evaluation_table(evaluate(methods, reference_of_skeleton("the truth", motion())))
    text = shown(table)
    assert "…" not in text
    assert "right shoulder abduction" in text
    assert "RMSE [deg]" in text


def test_csv_holds_what_was_measured(evaluation):
    found = [
        float(row["value"])
        for row in rows(evaluation_csv(evaluation))
        if (row["method"], row["quantity"], row["of"]) == ("left", "rmse", "left_knee_flexion")
    ]
    expected = evaluation.method("left").angles["left_knee_flexion"].rmse_deg
    assert found == pytest.approx([expected], rel=1e-5)


def test_markdown_has_a_row_for_every_angle(evaluation):
    lines = evaluation_table(evaluation).markdown().splitlines()
    widths = {line.count("|") for line in lines if line.startswith("|")}
    assert widths == {4}
    assert any(line.startswith("| left knee flexion | ") for line in lines)


def test_what_is_unknown_is_a_dash_and_an_empty_cell(evaluation):
    # The head is part of no angle; a still angle has no correlation.
    assert "–" in shown(evaluation_table(evaluation))
    still = [
        row["value"]
        for row in rows(evaluation_csv(evaluation))
        if (row["quantity"], row["of"]) == ("r", "left_elbow_flexion")
    ]
    assert still == ["", ""]


def test_agreement_is_shown_without_a_second_sensor_too():
    assert "left" in shown(*agreement_tables({"left": motion(rate=30.0)}, {}))


def test_agreement_tables_fit_into_eighty_columns():
    methods = {name: motion(rate=30.0) for name in ("left", "right", "mean", "fused")}
    text = shown(*agreement_tables(methods, {"left": np.eye(4)}))
    assert "…" not in text
    assert "left – right" in text


def test_agreement_csv_names_the_pair():
    methods = {name: motion(rate=30.0) for name in ("left", "right")}
    found = rows(agreement_csv(measure_agreement(methods, {}), stability_of(methods)))
    pair = [row for row in found if row["method"] == "left-right"]
    assert {row["quantity"] for row in pair} >= {"distance_as_logged", "rms_difference"}
