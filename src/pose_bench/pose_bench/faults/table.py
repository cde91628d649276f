"""The table of faults."""

from collections.abc import Callable, Sequence

import numpy as np

from pose_bench.faults.judging import (
    MAX_RATIO,
    MAX_RECOVERY_S,
    MAX_SAID_S,
    MAX_STEP_DEG,
    FaultResult,
)
from pose_evaluation.table import Table, table_of

COLUMNS: dict[str, Callable[[FaultResult], str]] = {
    "step": lambda result: f"{result.step_deg:.1f}",
    "RMSE": lambda result: _number(result.rmse_deg),
    "without it": lambda result: _number(result.reference_deg),
    "stamps": lambda result: _stamps(result.ahead, result.backwards, result.repeated),
    "said": lambda result: _number(result.said_s) if result.fault.said else "",
    "recovery": lambda result: _number(result.recovery_s),
    "gap": lambda result: f"{result.longest_gap_s:.2f}",
    "verdict": lambda result: ", ".join(result.broken) or "holds",
}


def fault_table(results: Sequence[FaultResult]) -> Table:
    """The table with an explanation of its columns."""
    holds = sum(not result.broken for result in results)
    return table_of(
        "Faults in the live graph",
        "fault",
        ((result.fault.name, result) for result in results),
        COLUMNS,
        f"{holds} of {len(results)} faults keep all bounds. "
        "step [deg]: the largest change of a joint angle from one joint state to the next, "
        f"beyond the truth's own; at most {MAX_STEP_DEG:g}. RMSE [deg] of the twelve angles "
        "while the fault lasts, and that of an undisturbed run without the sensors that the "
        f"fault makes unusable; at most {MAX_RATIO:g} times that. stamps: joint states ahead "
        "of the clock / backwards / repeated; none. said [s]: until `/diagnostics` warns by "
        f"name; at most {MAX_SAID_S:g}. recovery [s]: from the fault's end until every half "
        f"second is as good again; at most {MAX_RECOVERY_S:g}. gap [s]: the longest silence "
        "of the joint states.",
    )


def row(result: FaultResult) -> list[str]:
    """Cells of one line."""
    return [result.fault.name, *(cell(result) for cell in COLUMNS.values())]


def _stamps(*counts: int) -> str:
    return " / ".join(map(str, counts)) if any(counts) else "–"


def _number(value: float) -> str:
    if np.isnan(value):
        return "never"
    return "not within 5" if np.isinf(value) else f"{value:.1f}"
