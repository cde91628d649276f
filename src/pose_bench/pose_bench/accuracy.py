"""The accuracy suite: every method on every cell, in several processes."""

from collections.abc import Sequence
from pathlib import Path

from pose_bench.methods import Method, run_method
from pose_bench.pool import Progress, ignored, run_all
from pose_bench.scoring import Score, score
from pose_bench.sessions import BenchSession, bench_session
from pose_bench.suite import KNOWN, Cell
from pose_calibration.session_calibration import calibrate
from pose_core.errors import PoseError
from pose_core.session.extrinsics import Extrinsics
from pose_core.streams.series import series_from_samples
from pose_evaluation.time_shift import estimate_time_shift
from pose_sim.scene import SENSORS


def run_cell(cell: Cell, methods: Sequence[Method], cache: Path | None = None) -> list[Score]:
    """Make a cell's session and run every method on it.

    A method that fails has a row that says why.
    """
    session = bench_session(
        cell.session, imus=any(method.use_imus for method in methods), cache=cache
    )
    raw_lag_s = _raw_lag_s(session)
    known: Extrinsics | PoseError = session.extrinsics
    if cell.condition != KNOWN:
        known = _calibrated(session)
    return [_scored(cell, method, session, known, raw_lag_s) for method in methods]


def run_suite(
    cells: Sequence[Cell],
    methods: Sequence[Method],
    *,
    cache: Path | None = None,
    jobs: int = 1,
    progress: Progress = ignored,
) -> list[Score]:
    """Run all cells; the scores are in the order of the cells and methods.

    Args:
        cells: The cells.
        methods: The methods.
        cache: Folder for the IMUs' samples, see :func:`pose_bench.sessions.bench_session`.
        jobs: Processes at once.
        progress: Told before the first cell and after each.
    """
    arguments = [(cell, tuple(methods), cache) for cell in cells]
    found = run_all(run_cell, arguments, jobs=jobs, progress=progress)
    return [score for scores in found for score in scores]


def _raw_lag_s(session: BenchSession) -> float:
    raw = series_from_samples(s for s in session.skeletons if s.sensor == SENSORS[0])
    return estimate_time_shift(raw, session.judged_truth)


def _calibrated(session: BenchSession) -> Extrinsics | PoseError:
    """The extrinsics and clock offset that the session's own motion tells."""
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
    except Exception as error:  # one method's failure must not cost the others' figures
        reason = f"{type(error).__name__}: {error}"
        return Score(cell=cell, method=method.name, error=reason.splitlines()[0])
