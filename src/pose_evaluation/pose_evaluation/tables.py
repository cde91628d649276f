"""The result tables of the terminal, of the report and of Markdown; all figures as CSV."""

import csv
import io
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace

from pose_core.api import ANGLES
from pose_core.finite_numbers import mean_known
from pose_core.joints import SIDES
from pose_evaluation.agreement import MethodStability, ViewAgreement
from pose_evaluation.scores import Evaluation, MethodScores
from pose_evaluation.table import (
    BestOf,
    Cell,
    Row,
    Table,
    nearest_zero,
    number,
    number_row,
    table_of,
)

SUMMARY: tuple[tuple[str, Callable[[MethodScores], float], int, BestOf | None, bool], ...] = (
    ("mean absolute bias [deg]", lambda m: m.mean_absolute_bias_deg, 1, min, False),
    ("joint position error [mm]", lambda m: m.mpjpe_mm, 0, min, False),
    ("bone length SD [mm]", lambda m: m.mean_bone_sd_mm, 1, min, False),
    ("RMS jerk [m/s³]", lambda m: m.mean_jerk, 0, min, False),
    ("lag [ms]", lambda m: 1000.0 * m.shift_s, 0, nearest_zero, True),
    ("instants with a pose [%]", lambda m: 100.0 * m.coverage, 0, None, False),
)
"""Figures over all angles: name, value, digits, which is best, whether signed."""

CsvRow = tuple[str, str, str, float, str]
"""Method or pair, quantity, of what, value, unit."""


def readable(name: str) -> str:
    """Convert an identifier to words."""
    return name.replace("_", " ")


def method_label(name: str) -> str:
    """Label of a method."""
    return name.replace("+imus", " + IMUs")


def summary_rows(methods: Sequence[MethodScores]) -> list[Row]:
    """The lines of :data:`SUMMARY`."""
    return [
        number_row(name, [value(method) for method in methods], digits, best, sign=sign)
        for name, value, digits, best, sign in SUMMARY
    ]


def evaluation_table(evaluation: Evaluation) -> Table:
    """RMSE [deg] and r by angle and method, the best RMSE marked."""
    methods = evaluation.methods

    def row(name: str, figures: Sequence[tuple[float, float]], is_summary: bool) -> Row:
        best = number_row(name, [rmse for rmse, _ in figures], 1, min)
        return Row(
            name=name,
            cells=[
                Cell(text=f"{number(rmse, 1):>5} {number(r, 2):>4}", is_best=cell.is_best)
                for cell, (rmse, r) in zip(best.cells, figures, strict=True)
            ],
            is_summary=is_summary,
        )

    angles = {name: [method.angles[name] for method in methods] for name in ANGLES}
    means = [(m.mean_rmse_deg, m.mean_r) for m in methods]
    subject = "simulated sensors, " if evaluation.synthetic else ""
    summary = summary_rows(methods)
    return Table(
        caption=f"Joint angle error against {evaluation.reference} "
        f"({subject}{evaluation.duration_s:.1f} s)",
        head="angle",
        columns=[method_label(method.name) for method in methods],
        rows=(
            *(
                row(readable(name), [(s.rmse_deg, s.r) for s in scores], False)
                for name, scores in angles.items()
            ),
            row("mean of the angles", means, True),
            replace(summary[0], is_summary=True),
            *summary[1:],
        ),
        note="RMSE [deg], Pearson's r (– where it hardly moves); smallest error in bold",
    )


def view_tables(views: Sequence[ViewAgreement]) -> list[Table]:
    """Agreement of the sensors."""
    if not views:
        return []
    distance = table_of(
        "Mean distance of the same joint in two views [cm]",
        "views",
        ((f"{view.first} – {view.second}", view) for view in views),
        {
            "as logged": lambda view: number(view.as_logged_cm, 1),
            "calibrated": lambda view: number(view.calibrated_cm, 1),
            "best rigid fit": lambda view: number(view.best_rigid_cm, 1),
            "angles, RMS [deg]": lambda view: number(
                mean_known(list(view.angle_difference_deg.values())), 1
            ),
            "instants": lambda view: str(view.frames),
        },
        "The best rigid fit to the same data is the lower bound for any calibration.",
    )
    return [distance, *(_difference_table(view) for view in views)]


RIGID = ("li2020", "zhang2015")
"""Methods whose bones keep their lengths."""


def stability_table(stability: Mapping[str, MethodStability]) -> Table:
    """Frames, gaps, bones and jerk of every method."""
    rigid = " and ".join(name for name in RIGID if name in stability)
    note = "The default estimator lets shoulders, hips, knees and feet slide."
    if rigid:
        note = f"The bones of {rigid} are constant by construction. {note}"
    return table_of(
        "Stability of each method",
        "method",
        ((method_label(name), each) for name, each in stability.items()),
        {
            "frames": lambda each: str(each.frames),
            "gaps > 0.2 s": lambda each: str(each.gaps),
            "longest [s]": lambda each: number(each.longest_gap_s, 1),
            "bone SD [mm]": lambda each: number(each.mean_bone_sd_mm, 1),
            "bone CV [%]": lambda each: number(each.mean_bone_cv_percent, 1),
            "RMS jerk [m/s³]": lambda each: number(each.mean_jerk, 0),
        },
        note,
    )


def evaluation_csv(evaluation: Evaluation) -> str:
    """All figures, one per row: method, quantity, of what, value, unit."""
    rows: list[CsvRow] = []
    for method in evaluation.methods:
        for angle, score in method.angles.items():
            low, high = score.limits_of_agreement_deg
            rows += _csv_rows(
                method.name,
                ("rmse", {angle: score.rmse_deg}, "deg"),
                ("bias", {angle: score.bias_deg}, "deg"),
                ("r", {angle: score.r}, "-"),
                ("limit_of_agreement_low", {angle: low}, "deg"),
                ("limit_of_agreement_high", {angle: high}, "deg"),
                ("samples", {angle: score.samples}, "-"),
            )
        rows += _csv_rows(
            method.name,
            ("position_error", method.joint_error_mm, "mm"),
            ("bone_length_sd", method.bone_sd_mm, "mm"),
            ("rms_jerk", method.jerk, "m/s^3"),
            ("time_shift", {"": method.shift_s}, "s"),
            ("coverage", {"": method.coverage}, "-"),
        )
    return _csv(evaluation.reference, evaluation.synthetic, rows)


def agreement_csv(
    views: Iterable[ViewAgreement],
    stability: Mapping[str, MethodStability],
    *,
    synthetic: bool = False,
) -> str:
    """All figures, one per row: method or pair, quantity, of what, value, unit."""
    rows: list[CsvRow] = []
    for view in views:
        rows += _csv_rows(
            f"{view.first}-{view.second}",
            ("instants", {"": view.frames}, "-"),
            ("distance_as_logged", {"": view.as_logged_cm}, "cm"),
            ("distance_calibrated", {"": view.calibrated_cm}, "cm"),
            ("distance_best_rigid", {"": view.best_rigid_cm}, "cm"),
            ("rms_difference", view.angle_difference_deg, "deg"),
        )
    for name, each in stability.items():
        rows += _csv_rows(
            name,
            ("frames", {"": each.frames}, "-"),
            ("gaps", {"": each.gaps}, "-"),
            ("longest_gap", {"": each.longest_gap_s}, "s"),
            ("bone_length_cv", each.bone_cv_percent, "%"),
            ("bone_length_sd", each.bone_sd_mm, "mm"),
            ("rms_jerk", each.jerk, "m/s^3"),
        )
    return _csv("none", synthetic, rows)


def _csv_rows(name: str, *figures: tuple[str, Mapping[str, float], str]) -> list[CsvRow]:
    """A row for each value: of a method or pair, each quantity with its values and unit."""
    return [
        (name, quantity, of, float(value), unit)
        for quantity, values, unit in figures
        for of, value in values.items()
    ]


def _difference_table(view: ViewAgreement) -> Table:
    angles = [name.removeprefix(f"{SIDES[0]}_") for name in ANGLES[: len(ANGLES) // len(SIDES)]]
    return Table(
        caption=f"RMS difference of angles, {view.first} – {view.second} [deg]",
        head="angle",
        columns=[f"{side} limb" for side in SIDES],
        rows=[
            number_row(
                readable(angle), [view.angle_difference_deg[f"{side}_{angle}"] for side in SIDES], 1
            )
            for angle in angles
        ],
    )


def _csv(reference: str, synthetic: bool, rows: Iterable[CsvRow]) -> str:
    reference += ", simulated sensors" if synthetic else ""
    head = ("reference", "method", "quantity", "of", "value", "unit")
    return csv_text(head, ((reference, *row) for row in rows))


def csv_text(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Format a table as CSV; unknown values are empty."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(head)
    writer.writerows([_cell(value) for value in row] for row in rows)
    return out.getvalue()


def _cell(value: object) -> object:
    if isinstance(value, float):
        return f"{value:.6g}" if math.isfinite(value) else ""
    return value
