"""Scores as CSV: one row a cell and method, or whatever else was compared."""

import csv
import io
import math
from collections.abc import Sequence
from dataclasses import fields
from typing import Any

from pose_bench.means import ratios
from pose_bench.methods import BASELINE
from pose_bench.scoring import Score
from pose_bench.suite import Cell
from pose_core.body.joint_angles import ANGLES

FIGURES = tuple(
    field.name
    for field in fields(Score)
    if field.name not in ("cell", "method", "error", "angle_rmse_deg")
)


def scores_csv(scores: Sequence[Score]) -> str:
    """One row a cell and method, all figures."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    ratio_names = (f"rmse_to_{BASELINE}", f"mpjpe_to_{BASELINE}")
    cell_names = tuple(field.name for field in fields(Cell))
    angle_names = tuple(f"rmse_deg_{angle}" for angle in ANGLES)
    writer.writerow(
        ("subject_kind", *cell_names, "method", *ratio_names, *FIGURES, *angle_names, "error")
    )
    for ratio in ratios(scores):
        score = ratio.score
        values = (
            ratio.rmse,
            ratio.mpjpe,
            *(getattr(score, name) for name in FIGURES),
            *(score.angle_rmse_deg.get(angle, math.nan) for angle in ANGLES),
        )
        writer.writerow(
            (
                "synthetic",
                *(getattr(score.cell, name) for name in cell_names),
                score.method,
                *(_cell(float(value)) for value in values),
                score.error,
            )
        )
    return out.getvalue()


def rows_csv(rows: Sequence[Any]) -> str:
    """One row a dataclass value, all of one kind; of real people."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    names = [each.name for each in fields(rows[0])] if rows else []
    writer.writerow(("subject_kind", *names))
    for row in rows:
        writer.writerow(("real", *(_cell(getattr(row, name)) for name in names)))
    return out.getvalue()


def _cell(value: object) -> str:
    if isinstance(value, float):
        return f"{value:.6g}" if math.isfinite(value) else ""
    return str(value)
