"""The table of faults."""

from collections.abc import Sequence

import numpy as np

from pose_bench.faults.judging import (
    MOST_RATIO,
    MOST_RECOVERY_S,
    MOST_SAID_S,
    MOST_STEP_DEG,
    FaultResult,
)
from pose_bench.tables import TextTable

HEADER = "fault, step, RMSE, without it, stamps, said, recovery, gap, verdict"


def fault_table(results: Sequence[FaultResult]) -> TextTable:
    """The table with an explanation of its columns."""
    holds = sum(not result.broken for result in results)
    return TextTable(
        title="Faults in the live graph",
        header=HEADER.split(", "),
        rows=[row(result) for result in results],
        note=f"{holds} of {len(results)} faults keep all bounds. "
        "step [deg]: the largest change of a joint angle from one joint state to the next, "
        f"beyond the truth's own; at most {MOST_STEP_DEG:g}. RMSE [deg] of the twelve angles "
        "while the fault lasts, and that of an undisturbed run without the sensors that the "
        f"fault makes unusable; at most {MOST_RATIO:g} times that. stamps: joint states ahead "
        "of the clock / backwards / repeated; none. said [s]: until `/diagnostics` warns by "
        f"name; at most {MOST_SAID_S:g}. recovery [s]: from the fault's end until every half "
        f"second is as good again; at most {MOST_RECOVERY_S:g}. gap [s]: the longest silence "
        "of the joint states.",
    )


def row(result: FaultResult) -> list[str]:
    """Cells of one line."""
    fault = result.fault
    stamps = f"{result.ahead} / {result.backwards} / {result.repeated}"
    return [
        fault.name,
        f"{result.step_deg:.1f}",
        _number(result.rmse_deg),
        _number(result.reference_deg),
        "–" if stamps == "0 / 0 / 0" else stamps,
        _number(result.said_s) if fault.said else "",
        _number(result.recovery_s),
        f"{result.longest_gap_s:.2f}",
        ", ".join(result.broken) or "holds",
    ]


def _number(value: float) -> str:
    if np.isnan(value):
        return "never"
    return "not within 5" if np.isinf(value) else f"{value:.1f}"
