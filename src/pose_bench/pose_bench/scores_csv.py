"""The accuracy suite's scores as CSV: one row a cell and method."""

import csv
import io
import math
from collections.abc import Sequence
from dataclasses import fields

from pose_bench.means import ratios
from pose_bench.methods import BASELINE
from pose_bench.scoring import Score
from pose_bench.suite import Cell
from pose_fusion.body.joint_angles import ANGLES

FIGURES = tuple(
    field.name
    for field in fields(Score)
    if field.name not in ("cell", "method", "error", "angle_rmse_deg")
)


def to_csv(scores: Sequence[Score]) -> str:
    """One row a cell and method, all figures."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    ratio_names = (f"rmse_to_{BASELINE}", f"mpjpe_to_{BASELINE}")
    cell_names = tuple(field.name for field in fields(Cell))
    angle_names = tuple(f"rmse_deg_{angle}" for angle in ANGLES)
    writer.writerow(
        ("subject", *cell_names, "method", *ratio_names, *FIGURES, *angle_names, "error")
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
                *(f"{value:.6g}" if math.isfinite(value) else "" for value in values),
                score.error,
            )
        )
    return out.getvalue()
