"""The result tables: for the terminal, as CSV and as Markdown."""

import csv
import io
import math
from collections.abc import Callable, Iterable, Sequence

from rich import box
from rich.table import Table
from rich.text import Text

from pose_core.api import ANGLES
from pose_core.joints import SIDES
from pose_evaluation.agreement import Agreement, ViewAgreement
from pose_evaluation.methods import FUSED
from pose_evaluation.scores import Evaluation, MethodScores

UNKNOWN = "–"

SUMMARY: tuple[tuple[str, int, Callable[[MethodScores], float]], ...] = (
    ("mean |bias| [deg]", 1, lambda m: m.mean_absolute_bias_deg),
    ("joint position error [mm]", 0, lambda m: m.mpjpe_mm),
    ("bone length SD [mm]", 1, lambda m: m.mean_bone_sd_mm),
    ("RMS jerk [m/s³]", 0, lambda m: m.mean_jerk),
    ("time shift [ms]", 0, lambda m: 1000.0 * m.shift_s),
    ("instants covered [%]", 0, lambda m: 100.0 * m.coverage),
)


def readable(name: str) -> str:
    """Convert an identifier to words."""
    return name.replace("_", " ")


def number(value: float, digits: int, sign: bool = False) -> str:
    """Format a number; a dash if it is unknown."""
    if not math.isfinite(value):
        return UNKNOWN
    rounded = round(value, digits) + 0.0  # no −0.0
    return f"{rounded:{'+' if sign else ''}.{digits}f}"


def title_of(evaluation: Evaluation) -> str:
    """Title of an evaluation's tables."""
    subject = "synthetic subject, " if evaluation.synthetic else ""
    return (
        f"Joint angle error against {evaluation.reference} ({subject}{evaluation.duration_s:.1f} s)"
    )


def evaluation_table(evaluation: Evaluation) -> Table:
    """RMSE [deg] and r by angle and method, for the terminal; the best RMSE in bold."""
    table = Table(
        title=Text(title_of(evaluation), style="bold"),
        caption=Text("RMSE [deg], Pearson's r (– where it hardly moves); smallest error in bold"),
        title_justify="left",
        caption_justify="left",
        box=box.SIMPLE_HEAD,
        show_edge=False,
    )
    table.add_column("angle", no_wrap=True)
    for method in evaluation.methods:
        table.add_column(method.name, justify="right", no_wrap=True)
    for angle in ANGLES:
        rmse = [method.angles[angle].rmse_deg for method in evaluation.methods]
        r = [method.angles[angle].r for method in evaluation.methods]
        table.add_row(readable(angle), *_rmse_cells(rmse, r))
    table.add_section()
    rmse = [method.mean_rmse_deg for method in evaluation.methods]
    r = [method.mean_r for method in evaluation.methods]
    table.add_row("mean of the angles", *_rmse_cells(rmse, r))
    table.add_section()
    for name, digits, value in SUMMARY:
        cells = [number(value(method), digits) for method in evaluation.methods]
        table.add_row(Text(name), *cells)
    return table


def evaluation_markdown(evaluation: Evaluation) -> str:
    """RMSE, bias and r by angle and method, as a Markdown table."""
    names = [method.name for method in evaluation.methods]
    lines = [
        f"{title_of(evaluation)}: RMSE [deg] / bias [deg] / r",
        "",
        f"| angle | {' | '.join(names)} |",
        f"|---|{'---|' * len(names)}",
    ]
    for angle in ANGLES:
        scores = [method.angles[angle] for method in evaluation.methods]
        cells = [
            f"{number(s.rmse_deg, 1)} / {number(s.bias_deg, 1, sign=True)} / {number(s.r, 2)}"
            for s in scores
        ]
        lines.append(f"| {readable(angle)} | {' | '.join(cells)} |")
    cells = [
        f"**{number(m.mean_rmse_deg, 1)}** / {number(m.mean_absolute_bias_deg, 1)} "
        f"/ {number(m.mean_r, 2)}"
        for m in evaluation.methods
    ]
    lines.append(f"| mean (of sizes, for the bias) | {' | '.join(cells)} |")
    for name, digits, value in SUMMARY[1:]:
        cells = [number(value(method), digits) for method in evaluation.methods]
        lines.append(f"| {name} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def evaluation_csv(evaluation: Evaluation) -> str:
    """All figures, one per row: method, quantity, of what, value, unit."""
    rows: list[tuple[str, str, str, float, str]] = []
    for method in evaluation.methods:
        for angle, score in method.angles.items():
            rows.append((method.name, "rmse", angle, score.rmse_deg, "deg"))
            rows.append((method.name, "bias", angle, score.bias_deg, "deg"))
            rows.append((method.name, "r", angle, score.r, "-"))
            low, high = score.limits_of_agreement_deg
            rows.append((method.name, "limit_of_agreement_low", angle, low, "deg"))
            rows.append((method.name, "limit_of_agreement_high", angle, high, "deg"))
            rows.append((method.name, "samples", angle, score.samples, "-"))
        for joint, error in method.joint_error_mm.items():
            rows.append((method.name, "position_error", joint, error, "mm"))
        for bone, sd in method.bone_sd_mm.items():
            rows.append((method.name, "bone_length_sd", bone, sd, "mm"))
        for joint, jerk in method.jerk.items():
            rows.append((method.name, "rms_jerk", joint, jerk, "m/s^3"))
        rows.append((method.name, "time_shift", "", method.shift_s, "s"))
        rows.append((method.name, "coverage", "", method.coverage, "-"))
    return _csv(_reference(evaluation.reference, evaluation.synthetic), rows)


def agreement_tables(agreement: Agreement) -> list[Table]:
    """Tables of the figures without a reference, for the terminal."""
    tables = []
    if agreement.views:
        views = _table("Do the views agree? (mean distance of the same joint)")
        for heading in ("views", "instants", "as logged", "calibrated", "best rigid fit", "angles"):
            views.add_column(heading, justify="left" if heading == "views" else "right")
        for view in agreement.views:
            differences = list(view.angle_difference_deg.values())
            known = [d for d in differences if math.isfinite(d)]
            mean = sum(known) / len(known) if known else math.nan
            views.add_row(
                f"{view.first} – {view.second}",
                str(view.frames),
                f"{number(view.as_logged_cm, 1)} cm",
                f"{number(view.calibrated_cm, 1)} cm",
                f"{number(view.best_rigid_cm, 1)} cm",
                f"{number(mean, 1)}° RMS",
            )
        tables.append(views)
        tables += [_angle_difference_table(view) for view in agreement.views]
    steady = _table("Are bones constant, is motion smooth?")
    if FUSED in agreement.steadiness:
        steady.caption = Text("fused: shoulders, hips, knees and feet slide by a centimetre or so")
    for heading in ("method", "frames", "gaps > 0.2 s", "longest", "bone CV", "bone SD", "jerk"):
        steady.add_column(heading, justify="left" if heading == "method" else "right")
    for name, each in agreement.steadiness.items():
        steady.add_row(
            name,
            str(each.frames),
            str(each.gaps),
            f"{each.longest_gap_s:.1f} s",
            f"{number(each.mean_bone_cv_percent, 1)} %",
            f"{number(each.mean_bone_sd_mm, 1)} mm",
            f"{number(each.mean_jerk, 0)} m/s³",
        )
    tables.append(steady)
    return tables


def agreement_csv(agreement: Agreement, *, synthetic: bool = False) -> str:
    """All figures, one per row: method or pair, quantity, of what, value, unit."""
    rows: list[tuple[str, str, str, float, str]] = []
    for view in agreement.views:
        pair = f"{view.first}-{view.second}"
        rows.append((pair, "instants", "", view.frames, "-"))
        rows.append((pair, "distance_as_logged", "", view.as_logged_cm, "cm"))
        rows.append((pair, "distance_calibrated", "", view.calibrated_cm, "cm"))
        rows.append((pair, "distance_best_rigid", "", view.best_rigid_cm, "cm"))
        for angle, difference in view.angle_difference_deg.items():
            rows.append((pair, "rms_difference", angle, difference, "deg"))
    for name, each in agreement.steadiness.items():
        rows.append((name, "frames", "", each.frames, "-"))
        rows.append((name, "gaps", "", each.gaps, "-"))
        rows.append((name, "longest_gap", "", each.longest_gap_s, "s"))
        for bone, cv in each.bone_cv_percent.items():
            rows.append((name, "bone_length_cv", bone, cv, "%"))
            rows.append((name, "bone_length_sd", bone, each.bone_sd_mm[bone], "mm"))
        for joint, jerk in each.jerk.items():
            rows.append((name, "rms_jerk", joint, jerk, "m/s^3"))
    return _csv(_reference("none", synthetic), rows)


def _angle_difference_table(view: ViewAgreement) -> Table:
    table = _table(f"RMS difference of the angles, {view.first} – {view.second} [deg]")
    table.add_column("angle")
    for side in SIDES:
        table.add_column(f"{side} limb", justify="right")
    for angle in ANGLES[: len(ANGLES) // len(SIDES)]:
        joint = angle.removeprefix(f"{SIDES[0]}_")
        cells = [number(view.angle_difference_deg[f"{side}_{joint}"], 1) for side in SIDES]
        table.add_row(readable(joint), *cells)
    return table


def _table(title: str) -> Table:
    return Table(
        title=Text(title, style="bold"),
        title_justify="left",
        caption_justify="left",
        box=box.SIMPLE_HEAD,
        show_edge=False,
    )


def _rmse_cells(rmse: Sequence[float], r: Sequence[float]) -> list[Text]:
    known = [value for value in rmse if math.isfinite(value)]
    best = min(known) if known else math.nan
    return [
        Text(
            f"{number(error, 1):>5} {number(correlation, 2):>4}",
            style="bold" if error == best else "",
        )
        for error, correlation in zip(rmse, r, strict=True)
    ]


def _reference(name: str, synthetic: bool) -> str:
    return f"{name}, synthetic subject" if synthetic else name


def _csv(reference: str, rows: Sequence[tuple[str, str, str, float, str]]) -> str:
    head = ("reference", "method", "quantity", "of", "value", "unit")
    return csv_text(head, ((reference, *names, float(value), unit) for *names, value, unit in rows))


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
