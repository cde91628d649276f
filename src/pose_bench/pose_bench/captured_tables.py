"""Tables and rows of the suite on captured motion."""

from collections.abc import Callable, Sequence

import numpy as np

from pose_bench.captured import BASELINE, CapturedScore
from pose_bench.tables import percent
from pose_evaluation.table import Row, Table, number, text_row
from pose_evaluation.tables import csv_text

NOTE = (
    f"Motion of real people, simulated sensors. Ratios: mean over sessions to {BASELINE} on the "
    "same samples with the true extrinsics and clocks. Lag against the truth; without IMUs a "
    "tracker's own delay cannot be told from motion. 68 % and 95 % within 1 and 2 deviations would "
    "be honest. IMUs: share of those worn that were in use at the end, and when the median one "
    "joined, latest session."
)


def _mean(name: str, digits: int) -> Callable[[Sequence[CapturedScore]], str]:
    """Mean of a figure over sessions."""
    return lambda scores: number(float(np.mean([getattr(each, name) for each in scores])), digits)


def _worn(scores: Sequence[CapturedScore]) -> int:
    return sum(score.imus for score in scores)


def _within(scores: Sequence[CapturedScore]) -> str:
    shares = np.mean([(score.within_1, score.within_2) for score in scores], axis=0)
    return ", ".join(percent(share) for share in shares.tolist())


COLUMNS: dict[str, Callable[[Sequence[CapturedScore]], str]] = {
    "RMSE / joint_kf": _mean("rmse_ratio", 2),
    "worst": lambda scores: number(max(each.rmse_ratio for each in scores), 2),
    "RMSE [°]": _mean("rmse_deg", 1),
    "hips, knees [°]": _mean("hip_knee_deg", 1),
    "r": _mean("r", 2),
    "MPJPE [mm]": _mean("mpjpe_mm", 0),
    "/ joint_kf": _mean("mpjpe_ratio", 2),
    "lag [ms]": _mean("lag_ms", 0),
    "less the trackers' delay": lambda scores: number(
        float(np.mean([each.lag_ms - each.tracker_delay_ms for each in scores])), 0
    ),
    "largest": lambda scores: number(max((each.lag_ms for each in scores), key=abs), 0),
    "jerk [m/s³]": _mean("jerk", 0),
    "within 1, 2 σ": _within,
    "IMUs": lambda scores: (
        percent(sum(each.imus_used for each in scores) / _worn(scores)) if _worn(scores) else "–"
    ),
    "from [s]": lambda scores: (
        number(max(each.imu_from_s for each in scores), 0) if _worn(scores) else "–"
    ),
}
"""Functions from the scores of a row, without failed ones, to a cell."""


def summary_table(scores: Sequence[CapturedScore], title: str) -> Table:
    """Table with a row per method."""
    return _table(title, "method", _rows(scores, lambda score: score.method))


def source_table(scores: Sequence[CapturedScore], methods: Sequence[str]) -> Table:
    """Table with a row per source of clips, condition, and selected method."""
    own = [score for score in scores if score.method in methods]
    rows = _rows(own, lambda s: f"{s.source}, {s.method}")
    rows += _rows(own, lambda s: f"{s.condition}, {s.method}")
    return _table("By source", "source, method", rows)


def _table(title: str, first: str, rows: Sequence[Row]) -> Table:
    return Table(caption=title, head=first, columns=list(COLUMNS), rows=rows, note=NOTE)


def _rows(scores: Sequence[CapturedScore], name_of: Callable[[CapturedScore], str]) -> list[Row]:
    """A row for the scores of each name."""
    return [
        text_row(name, *_cells([score for score in scores if name_of(score) == name]))
        for name in dict.fromkeys(map(name_of, scores))
    ]


def _cells(scores: Sequence[CapturedScore]) -> list[str]:
    """Cells of one row: figures over the sessions that did not fail."""
    known = [score for score in scores if not score.error]
    failed = len(scores) - len(known)
    if not known:
        return [f"{failed} failed", *[""] * (len(COLUMNS) - 1)]
    cells = {name: cell(known) for name, cell in COLUMNS.items()}
    if failed:
        cells["worst"] += f", {failed} failed"
    return list(cells.values())


def captured_csv(scores: Sequence[CapturedScore]) -> str:
    """Scores of every session as CSV, with four digits."""
    rows = ([f"{v:.4g}" if isinstance(v, float) else v for v in vars(s).values()] for s in scores)
    return csv_text(list(vars(scores[0])), rows)
