"""The accuracy suite's scores as tables: by method, motion, level and condition."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence

from pose_bench.means import MethodMeans, Ratio, ratios
from pose_bench.methods import BASELINE, METHODS
from pose_bench.scoring import Score
from pose_bench.suite import CONDITIONS, LEVELS, TUNING_CHOREOGRAPHIES, Cell
from pose_bench.tables import TextTable, number, percent
from pose_bench.targets import target_table
from pose_core.finite_numbers import mean_known

COVERAGES = ("within_1", "within_2", "all_within_1", "all_within_2")
TUNING = ("may look at it", "has not seen it")
NOTES = {
    "motion": "Tuning may look at motions marked *, with other seeds.",
    "tuning": "A session that tuning has not seen has another motion and another seed.",
}
SYNTHETIC = "Synthetic subject: no person moved for these figures."


def tables(scores: Sequence[Score]) -> list[TextTable]:
    """All tables, the one by method first."""
    found = ratios(scores)
    levels = _present(LEVELS, (score.cell.level for score in scores))
    conditions = _present(CONDITIONS, (score.cell.condition for score in scores))
    motions = list(dict.fromkeys(_motion(score.cell) for score in scores))
    made = [
        by_method(
            found,
            f"Accuracy, mean over {_count(found)}",
            ACCURACY,
            f"{SYNTHETIC} RMSE, r and the size of the bias: mean over 12 angles. Ratios: to "
            f"{BASELINE}, which is given the true extrinsics.",
        ),
        worst_cells(found),
        by_method(
            found,
            "Timing",
            TIMING,
            "lag: of the angles against the truth; added: beyond the raw left Kinect's; "
            "wait: from an estimate's instant to the arrival of the sample that completed it; "
            "CPU: of one estimate; instants: share of time with an estimate.",
        ),
        uncertainty(found),
        _by(found, "motion", _motion, motions),
        _by(found, "tuning", _tuning, _present(TUNING, map(_tuning, (s.cell for s in scores)))),
        _by(found, "level", lambda cell: cell.level, levels),
        _by(found, "what is known", lambda cell: cell.condition, conditions),
        target_table(found),
    ]
    return [table for table in made if table.rows]


Columns = Mapping[str, Callable[[MethodMeans], str]]
"""Functions that format a method's cell, by the column's heading."""
ACCURACY: Columns = {
    "RMSE ratio": lambda mean: number(mean.rmse_ratio, 2),
    "RMSE [°]": lambda mean: number(mean("rmse_deg"), 1),
    "hip, knee [°]": lambda mean: number(mean("hip_knee_rmse_deg"), 1),
    "r": lambda mean: number(mean("r"), 3),
    "bias [°]": lambda mean: number(mean("bias_deg"), 1),
    "MPJPE [mm]": lambda mean: number(mean("mpjpe_mm"), 0),
    "MPJPE ratio": lambda mean: number(mean.mpjpe_ratio, 2),
}
TIMING: Columns = {
    "lag [ms]": lambda mean: number(mean("lag_ms"), 0),
    "added [ms]": lambda mean: number(mean("added_lag_ms"), 0, sign=True),
    "wait [ms]": lambda mean: number(mean("latency_ms"), 0),
    "CPU [ms]": lambda mean: number(mean("cpu_ms"), 1),
    "instants": lambda mean: percent(mean("instants")),
    "failed": lambda mean: str(mean.failed),
}


def by_method(found: Sequence[Ratio], title: str, columns: Columns, note: str) -> TextTable:
    """A table with a row for each method: means over the cells."""
    table = TextTable(title=title, header=("method", *columns), note=note)
    for method in _methods(found):
        mean = MethodMeans(found, method)
        table.rows.append((method, *(show(mean) for show in columns.values())))
    return table


def worst_cells(found: Sequence[Ratio]) -> TextTable:
    """Cells with the largest ratio to the baseline, by method."""
    table = TextTable(
        title=f"Worst RMSE / {BASELINE}",
        header=("method", "motion and level, mean of seeds", "ratio", "single session", "ratio"),
    )
    for method in _methods(found):
        mean = MethodMeans(found, method)
        motion, motion_ratio = mean.worst_motion
        cell, cell_ratio = mean.worst_cell
        table.rows.append((method, motion, number(motion_ratio, 2), cell, number(cell_ratio, 2)))
    return table


def uncertainty(found: Sequence[Ratio]) -> TextTable:
    """Consistency of each method's published standard deviations."""
    table = TextTable(
        title="Uncertainty",
        header=("method", "12 angles ≤ 1 σ", "≤ 2 σ", "all joints ≤ 1 σ", "≤ 2 σ"),
        note="Share of the errors within 1 and 2 published standard deviations; "
        "68 % and 95 % would be consistent.",
    )
    for method in _methods(found):
        mean = MethodMeans(found, method)
        shares = [mean(figure) for figure in COVERAGES]
        if any(math.isfinite(share) for share in shares):
            table.rows.append((method, *map(percent, shares)))
    return table


def failures(scores: Iterable[Score]) -> list[str]:
    """One line for each score without figures."""
    return [f"{s.method} on {s.cell.name}: {s.error}" for s in scores if s.error]


def _by(
    found: Sequence[Ratio], what: str, key: Callable[[Cell], str], groups: Sequence[str]
) -> TextTable:
    """Mean ratio to the baseline by group of cells (rows) and method (columns)."""
    methods = _methods(found)
    table = TextTable(
        title=f"RMSE / {BASELINE} by {what}",
        header=(what, *methods, f"{BASELINE} RMSE"),
        note=NOTES.get(what, ""),
    )
    for group in groups:
        own = [ratio for ratio in found if key(ratio.score.cell) == group]
        cells = [
            number(mean_known([ratio.rmse for ratio in own if ratio.score.method == method]), 2)
            for method in methods
        ]
        baseline = [r.score.rmse_deg for r in own if r.score.method == BASELINE]
        table.rows.append((group, *cells, f"{number(mean_known(baseline), 1)}°"))
    return table


def _motion(cell: Cell) -> str:
    return f"{cell.choreography}{' *' if cell.choreography in TUNING_CHOREOGRAPHIES else ''}"


def _tuning(cell: Cell) -> str:
    return TUNING[0 if cell.is_seen else 1]


def _present(names: Sequence[str], found: Iterable[str]) -> list[str]:
    there = set(found)
    return [name for name in names if name in there]


def _methods(found: Sequence[Ratio]) -> list[str]:
    return _present([method.name for method in METHODS], (r.score.method for r in found))


def _count(found: Sequence[Ratio]) -> str:
    cells = {ratio.score.cell for ratio in found}
    total_s = sum(cell.duration_s for cell in cells)
    return f"{len(cells)} sessions, {total_s / 60.0:.0f} min"
