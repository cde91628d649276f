"""Tables and rows of the suite on captured motion."""

from collections.abc import Callable, Sequence
from dataclasses import asdict, astuple

import numpy as np

from pose_bench.captured import BASELINE, CapturedScore
from pose_bench.tables import TextTable, number, percent
from pose_evaluation.tables import csv_text

NOTE = (
    f"Motion of real people, simulated sensors. Ratios: mean over sessions to {BASELINE} on the "
    "same samples with the true extrinsics and clocks. Lag against the truth; without IMUs a "
    "tracker's own delay cannot be told from motion. 68 % and 95 % within 1 and 2 deviations would "
    "be honest. IMUs: share of those worn that were in use at the end, and when the median one "
    "joined, latest session."
)
HEADER = (
    "RMSE / joint_kf",
    "worst",
    "RMSE [°]",
    "hips, knees [°]",
    "r",
    "MPJPE [mm]",
    "/ joint_kf",
    "lag [ms]",
    "less the trackers' delay",
    "largest",
    "jerk [m/s³]",
    "within 1, 2 σ",
    "IMUs",
    "from [s]",
)


def summary_table(scores: Sequence[CapturedScore], title: str) -> TextTable:
    """Table with a row per method."""
    return _table(scores, title, "method", lambda score: score.method)


def source_table(scores: Sequence[CapturedScore], methods: Sequence[str]) -> TextTable:
    """Table with a row per source of clips, condition, and selected method."""
    own = [score for score in scores if score.method in methods]
    table = _table(own, "By source", "source, method", lambda s: f"{s.source}, {s.method}")
    known = _table(own, "", "", lambda s: f"{s.condition}, {s.method}")
    table.rows += known.rows
    return table


def _table(
    scores: Sequence[CapturedScore],
    title: str,
    first: str,
    row_of: Callable[[CapturedScore], str],
) -> TextTable:
    rows: list[Sequence[str]] = [
        (name, *_cells([score for score in scores if row_of(score) == name]))
        for name in dict.fromkeys(map(row_of, scores))
    ]
    return TextTable(title=title, header=(first, *HEADER), rows=rows, note=NOTE)


def _cells(scores: Sequence[CapturedScore]) -> list[str]:
    """Cells of one row: means over sessions."""
    failed = sum(bool(score.error) for score in scores)
    scores = [score for score in scores if not score.error]
    if not scores:
        return [f"{failed} failed", *[""] * (len(HEADER) - 1)]

    def mean(name: str) -> float:
        return float(np.mean([getattr(score, name) for score in scores]))

    beyond = [score.lag_ms - score.tracker_delay_ms for score in scores]
    worst = number(max(score.rmse_ratio for score in scores), 2)
    worn = sum(score.imus for score in scores)
    return [
        number(mean("rmse_ratio"), 2),
        f"{worst}, {failed} failed" if failed else worst,
        number(mean("rmse_deg"), 1),
        number(mean("hip_knee_deg"), 1),
        number(mean("r"), 2),
        number(mean("mpjpe_mm"), 0),
        number(mean("mpjpe_ratio"), 2),
        number(mean("lag_ms"), 0),
        number(float(np.mean(beyond)), 0),
        number(max((score.lag_ms for score in scores), key=abs), 0),
        number(mean("jerk"), 0),
        f"{percent(mean('within_1'))}, {percent(mean('within_2'))}",
        percent(sum(score.imus_used for score in scores) / worn) if worn else "–",
        number(max(score.imu_from_s for score in scores), 0) if worn else "–",
    ]


def captured_csv(scores: Sequence[CapturedScore]) -> str:
    """Scores of every session as CSV, with four digits."""
    rows = ([f"{v:.4g}" if isinstance(v, float) else v for v in astuple(s)] for s in scores)
    return csv_text(list(asdict(scores[0])), rows)
