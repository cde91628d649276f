"""The accuracy suite: every method on every cell, in several processes."""

import math
from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

from pose_bench import kinectmultitrack, uiprmd
from pose_bench.kinectmultitrack import OtherView
from pose_bench.means import ratios
from pose_bench.methods import BASELINE, Method, run_method
from pose_bench.one_camera import RAW
from pose_bench.pool import Progress, ignored, run_all
from pose_bench.scoring import Score, score
from pose_bench.sessions import BenchSession, bench_session
from pose_bench.suite import KNOWN, Cell
from pose_bench.uiprmd import AngleAgreement
from pose_calibration.session_calibration import calibrate
from pose_core.api import ANGLES, Extrinsics, series_from_samples
from pose_core.errors import PoseError
from pose_evaluation.tables import csv_text
from pose_evaluation.time_shift import estimate_time_shift
from pose_sim.scene import SENSORS

FIGURES = tuple(
    field.name
    for field in fields(Score)
    if field.name not in ("cell", "method", "error", "angle_rmse_deg")
)


ESTIMATORS = ("joint_kf", "li2020", "default")
"""Estimators that are run on one camera, compared with its raw view."""


def scores_csv(scores: Sequence[Score]) -> str:
    """All figures, one row per cell and method."""
    cell_names = tuple(field.name for field in fields(Cell))
    head = (
        *("subject_kind", *cell_names, "method", f"rmse_to_{BASELINE}", f"mpjpe_to_{BASELINE}"),
        *(*FIGURES, *(f"rmse_deg_{angle}" for angle in ANGLES), "error"),
    )
    rows = (
        (
            "synthetic",
            *(str(getattr(ratio.score.cell, name)) for name in cell_names),
            *(ratio.score.method, ratio.rmse, ratio.mpjpe),
            *(float(getattr(ratio.score, name)) for name in FIGURES),
            *(ratio.score.angle_rmse_deg.get(angle, math.nan) for angle in ANGLES),
            ratio.score.error,
        )
        for ratio in ratios(scores)
    )
    return csv_text(head, rows)


def rows_csv(rows: Sequence[Any]) -> str:
    """Dataclass values of one kind as CSV, one row each; real people."""
    names = [each.name for each in fields(rows[0])] if rows else []
    values = (("real", *(getattr(row, name) for name in names)) for row in rows)
    return csv_text(("subject_kind", *names), values)


def run_uiprmd(
    folder: Path, estimators: Sequence[str], *, jobs: int, progress: Progress
) -> tuple[list[AngleAgreement], dict[str, int]]:
    """Evaluate every repetition, raw and by each estimator; and count those left out, by reason.

    Raises:
        InputError: If the folder holds no usable repetition, or one is damaged.
    """
    repetitions = uiprmd.read_repetitions(folder)
    subjects = dict.fromkeys(repetition.subject for repetition in repetitions.used)
    by_subject = [[r for r in repetitions.used if r.subject == subject] for subject in subjects]
    arguments = [(own, name) for name in (RAW, *estimators) for own in by_subject]
    found = run_all(uiprmd.compare_subject, arguments, jobs=jobs, progress=progress)
    return [each for agreements in found for each in agreements], repetitions.left_out.as_dict()


def run_kinectmultitrack(
    folder: Path, estimators: Sequence[str], *, jobs: int, progress: Progress
) -> list[OtherView]:
    """Evaluate recordings of one person: each camera's raw view and estimates against the other's.

    Raises:
        InputError: If the folder holds no usable recording, or one is damaged.
    """
    recordings = kinectmultitrack.single_person_recordings(folder)
    arguments = [(recording, fed, tuple(estimators)) for recording in recordings for fed in (0, 1)]
    found = run_all(kinectmultitrack.compare_views, arguments, jobs=jobs, progress=progress)
    return [view for views in found for view in views]


def run_cell(cell: Cell, methods: Sequence[Method]) -> list[Score]:
    """Simulate a cell's session and run every method on it.

    A method that fails has a row with the reason.
    """
    session = bench_session(cell.session, imus=any(method.use_imus for method in methods))
    raw_lag_s = _raw_lag_s(session)
    known: Extrinsics | PoseError = session.extrinsics
    if cell.condition != KNOWN:
        known = _calibrated(session)
    return [_scored(cell, method, session, known, raw_lag_s) for method in methods]


def run_suite(
    cells: Sequence[Cell],
    methods: Sequence[Method],
    *,
    jobs: int = 1,
    progress: Progress = ignored,
) -> list[Score]:
    """Run all cells; the scores are in the order of the cells and methods.

    Args:
        cells: The cells.
        methods: The methods.
        jobs: Number of parallel processes.
        progress: Called before the first cell and after each.
    """
    arguments = [(cell, tuple(methods)) for cell in cells]
    found = run_all(run_cell, arguments, jobs=jobs, progress=progress)
    return [score for scores in found for score in scores]


def _raw_lag_s(session: BenchSession) -> float:
    raw = series_from_samples(s for s in session.skeletons if s.sensor == SENSORS[0])
    return estimate_time_shift(raw, session.judged_truth)


def _calibrated(session: BenchSession) -> Extrinsics | PoseError:
    """The extrinsics and clock offset estimated from the session's motion."""
    try:
        return calibrate(session.skeletons, session.extrinsics.sensors).extrinsics
    except PoseError as error:
        return error


def _scored(
    cell: Cell,
    method: Method,
    session: BenchSession,
    known: Extrinsics | PoseError,
    raw_lag_s: float,
) -> Score:
    extrinsics = session.extrinsics if method.true_extrinsics else known
    if isinstance(extrinsics, PoseError):
        return Score(cell=cell, method=method.name, error=f"not calibrated: {extrinsics}")
    try:
        run = run_method(method, session, extrinsics)
        if not len(run.series):
            return Score(cell=cell, method=method.name, error="no estimates")
        return score(cell, method.name, run, session, raw_lag_s)
    except Exception as error:  # one method's failure must not affect the others
        reason = f"{type(error).__name__}: {error}"
        return Score(cell=cell, method=method.name, error=reason.splitlines()[0])
