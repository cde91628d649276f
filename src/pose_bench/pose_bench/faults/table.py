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


def fault_table(verdicts: Sequence[FaultResult]) -> TextTable:
    """The table with an explanation of its columns."""
    holds = sum(not verdict.broken for verdict in verdicts)
    return TextTable(
        title="Faults in the live graph",
        header=HEADER.split(", "),
        rows=[row(verdict) for verdict in verdicts],
        note=f"{holds} of {len(verdicts)} faults keep all bounds. "
        "step [deg]: the largest change of a joint angle from one joint state to the next, "
        f"beyond the truth's own; at most {MOST_STEP_DEG:g}. RMSE [deg] of the twelve angles "
        "while the fault lasts, and that of an undisturbed run without the sensors that the "
        f"fault makes unusable; at most {MOST_RATIO:g} times that. stamps: joint states ahead "
        "of the clock / backwards / repeated; none. said [s]: until `/diagnostics` warns by "
        f"name; at most {MOST_SAID_S:g}. recovery [s]: from the fault's end until every half "
        f"second is as good again; at most {MOST_RECOVERY_S:g}. gap [s]: the longest silence "
        "of the joint states.",
    )


def row(verdict: FaultResult) -> list[str]:
    """Cells of one line."""
    fault = verdict.fault
    stamps = f"{verdict.ahead} / {verdict.backwards} / {verdict.repeated}"
    return [
        fault.name,
        f"{verdict.step_deg:.1f}",
        _number(verdict.rmse_deg),
        _number(verdict.reference_deg),
        "–" if stamps == "0 / 0 / 0" else stamps,
        _number(verdict.said_s) if fault.said else "",
        _number(verdict.recovery_s),
        f"{verdict.longest_gap_s:.2f}",
        ", ".join(verdict.broken) or "holds",
    ]


def _number(value: float) -> str:
    if np.isnan(value):
        return "never"
    return "not within 5" if np.isinf(value) else f"{value:.1f}"
