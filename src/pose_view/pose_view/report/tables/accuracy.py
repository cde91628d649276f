"""Tables against a reference, in the layout of li2020's Tables 1 to 4: an angle per row.

Tables 1 and 3 of the paper contain the correlations, 2 and 4 the errors, of its two motions.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace

from pose_core.api import ANGLES
from pose_core.finite_numbers import mean_known
from pose_evaluation.scores import HIPS_AND_KNEES, AngleScore, Evaluation, MethodScores
from pose_evaluation.table import (
    BestOf,
    Row,
    Table,
    nearest_zero,
    number,
    number_row,
    table_of,
    text_row,
)
from pose_evaluation.tables import method_label, readable, summary_rows
from pose_evaluation.uncertainty import NORMAL_SHARE, Coverage, mean_coverage
from pose_view.report.tables.by_part import part_table


def accuracy_tables(evaluation: Evaluation) -> list[Table]:
    """Tables of correlation, error, bias, limits of agreement, and joint positions."""
    tables = [
        _angle_table(
            evaluation, "Correlation with the reference: Pearson's r [-]", lambda s: s.r, 3, max
        ),
        _angle_table(evaluation, "Error: RMSE [deg]", lambda s: s.rmse_deg, 1, min),
        _bias_table(evaluation),
        _limits_table(evaluation),
    ]
    if any(mean_known([method.mpjpe_mm]) > 0.0 for method in evaluation.methods):
        tables.append(_joint_table(evaluation))
    return tables


def overview_table(evaluation: Evaluation) -> Table:
    """Overview: one line per figure."""
    methods = evaluation.methods
    mean = f"RMSE, mean of {evaluation.angle_count} angles [deg]"
    return Table(
        caption="Overview of all methods",
        head="measure",
        columns=[method_label(method.name) for method in methods],
        rows=(
            number_row(mean, [m.mean_rmse_deg for m in methods], 1, min),
            number_row(
                "RMSE, hips and knees [deg]", [m.mean_leg_rmse_deg for m in methods], 1, min
            ),
            number_row("r, mean of the moving angles [-]", [m.mean_r for m in methods], 3, max),
            *summary_rows(methods),
        ),
        note=f"Over {evaluation.duration_s:.1f} s that all methods and the reference have in "
        "common; each method after removing its own lag. Best of each line in bold.",
    )


def coverage_table(coverage: Mapping[str, Mapping[str, Coverage]]) -> Table | None:
    """Shares of the errors within 1 and 2 σ of the published uncertainty."""
    totals = {name: mean_coverage(dict(each)) for name, each in coverage.items() if each}
    if not totals:
        return None
    table = table_of(
        "Consistency of the published uncertainty: share of the true angles within it",
        "method",
        ((method_label(name), each) for name, each in totals.items()),
        {
            "within 1 σ [%]": lambda each: number(100.0 * each.within_1, 1),
            "within 2 σ [%]": lambda each: number(100.0 * each.within_2, 1),
            "mean σ [deg]": lambda each: number(each.mean_stddev_deg, 1),
            "compared": lambda each: str(each.samples),
        },
        "Larger shares: errors are smaller than the published uncertainty; smaller: larger.",
    )
    one, two = (number(100.0 * share, 1) for share in NORMAL_SHARE)
    consistent = text_row("if consistent", one, two, "–", "–", is_summary=True)
    return replace(table, rows=(*table.rows, consistent))


def _angle_table(
    evaluation: Evaluation,
    caption: str,
    value: Callable[[AngleScore], float],
    digits: int,
    best: BestOf,
) -> Table:
    values = _of_angles(evaluation, value)

    def mean(name: str, angles: tuple[str, ...]) -> Row:
        means = [mean_known([each[angle] for angle in angles]) for each in values.values()]
        return number_row(name, means, digits, best, is_summary=True)

    return part_table(
        caption,
        "angle",
        values,
        [mean("mean of hips and knees", HIPS_AND_KNEES), mean("mean of all", ANGLES)],
        "Best in bold; – where the reference hardly moves." if digits == 3 else "Best in bold.",
        digits=digits,
        best=best,
    )


def _of_angles(
    evaluation: Evaluation, value: Callable[[AngleScore], float]
) -> dict[str, dict[str, float]]:
    """A figure by method and angle."""
    return {
        method.name: {angle: value(method.angles[angle]) for angle in ANGLES}
        for method in evaluation.methods
    }


def _bias_table(evaluation: Evaluation) -> Table:
    sizes = [method.mean_absolute_bias_deg for method in evaluation.methods]
    return part_table(
        "Bias: mean of method − reference [deg]",
        "angle",
        _of_angles(evaluation, lambda score: score.bias_deg),
        [number_row("mean size", sizes, 1, min, is_summary=True)],
        "Nearest to zero in bold.",
        digits=1,
        best=nearest_zero,
        sign=True,
    )


def _limits_table(evaluation: Evaluation) -> Table:
    def limits(method: MethodScores, angle: str) -> str:
        low, high = method.angles[angle].limits_of_agreement_deg
        return f"{number(low, 0, sign=True)} … {number(high, 0, sign=True)}"

    return Table(
        caption="Limits of agreement (Bland and Altman): bias ∓ 1.96 SD [deg]",
        head="angle",
        columns=[method_label(method.name) for method in evaluation.methods],
        rows=[
            text_row(readable(angle), *(limits(method, angle) for method in evaluation.methods))
            for angle in ANGLES
        ],
        note="19 of 20 differences lie between them, if they are normally distributed.",
    )


def _joint_table(evaluation: Evaluation) -> Table:
    means = [method.mpjpe_mm for method in evaluation.methods]
    return part_table(
        "Joint position error [mm]",
        "joint",
        {method.name: method.joint_error_mm for method in evaluation.methods},
        [number_row("mean (MPJPE)", means, 0, min, is_summary=True)],
        "Mean distance after one rigid alignment of the whole recording. Best in bold.",
        digits=0,
        best=min,
    )
