"""li2020's tables 1 to 4 and the shift of its figure 6: two motions, printed and measured."""

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pose_bench.sessions import BenchSession, SessionSpec, bench_session
from pose_core.api import SkeletonSeries, angle_series
from pose_core.arrays import FloatArray
from pose_core.finite_numbers import mean_known
from pose_evaluation.offline import MethodSetup, run_methods
from pose_evaluation.scores import score_method
from pose_evaluation.table import Table, number_row
from pose_io.arrays import IntArray
from pose_io.references.reference import reference_of_skeleton

LEG_ANGLES = ("hip_flexion", "hip_abduction", "knee_flexion")
KNEES = ("left_knee_flexion", "right_knee_flexion")
ANGLES = [f"{side}_{name}" for name in LEG_ANGLES for side in ("right", "left")]
PRINTED_METHODS = ("Kinect 1", "Kinect 2", "Moon", "li2020")
OUR_METHODS = ("left", "right", "joint_kf", "dof_kf", "li2020", "default")


@dataclass(frozen=True, kw_only=True)
class PaperMotion:
    """One of the paper's two motions, and the choreography that replaces it."""

    title: str
    choreography: str
    r: FloatArray  # (6, 4) [-] as printed, in the order of the names above
    error: FloatArray  # (6, 4) [°] as printed


def _motion(title: str, choreography: str) -> PaperMotion:
    """A motion with its printed figures, which are in ``li2020.csv``."""
    with Path(__file__).with_name("li2020.csv").open() as file:
        rows = [row[2:] for row in csv.reader(file) if row[0] == choreography]
    r, error = np.split(np.array(rows, float), 2, axis=1)
    return PaperMotion(title=title, choreography=choreography, r=r, error=error)


MOTIONS = (
    _motion("side leg lift, then jumps (tables 1, 2)", "leg_lift_jump"),
    _motion("side leg lift, then marching on the spot (tables 3, 4)", "leg_lift_march"),
)
NOTE = (
    "Printed: real Kinects v2 against Vicon. Here: the synthetic subject before virtual Kinects; "
    "dof_kf is the paper's ablation, default our filter without IMUs."
)


def motion_tables(motion: PaperMotion, levels: Sequence[str], seeds: Sequence[int]) -> list[Table]:
    """Correlations, errors and shifts of one motion; measured ones: means over levels and seeds."""
    sessions = [
        bench_session(
            SessionSpec(choreography=motion.choreography, level=level, seed=seed), imus=False
        )
        for level in levels
        for seed in seeds
    ]
    runs = [_run(session) for session in sessions]
    truths = [session.evaluated_truth for session in sessions]
    found = [_scores(*each) for each in zip(runs, truths, strict=True)]
    columns = [*(f"{name}, printed" for name in PRINTED_METHODS), *OUR_METHODS]
    tables = []
    for title, printed, index, digits in (
        ("Pearson's r", motion.r, 0, 3),
        ("RMSE [°]", motion.error, 1, 1),
    ):
        rows = [
            [*row, *(mean_known([each[m][angle][index] for each in found]) for m in OUR_METHODS)]
            for angle, row in zip(ANGLES, printed, strict=True)
        ]
        rows.append([mean_known(list(column)) for column in zip(*rows, strict=True)])
        lines = [
            number_row(name.replace("_", " "), row, digits)
            for name, row in zip([*ANGLES, "mean"], rows, strict=True)
        ]
        caption = f"li2020, {motion.title}: {title}"
        tables.append(Table(caption=caption, head="", columns=columns, rows=lines, note=NOTE))
    shifts = [_knee_shifts(run, truth.stamps_ns) for run, truth in zip(runs, truths, strict=True)]
    means = {name: np.mean([each[name] for each in shifts], axis=0) for name in OUR_METHODS[2:]}
    caption = f"li2020, {motion.title}: shift of the knees' flexion (figure 6)"
    columns = ["outside both cameras [%]", "shift from their mean [°]"]
    lines = [number_row(name, list(each), 1) for name, each in means.items()]
    return [*tables, Table(caption=caption, head="", columns=columns, rows=lines, note=NOTE)]


def _run(session: BenchSession) -> dict[str, SkeletonSeries]:
    """The skeletons of each method on one session."""
    setups = [MethodSetup(name=name, estimator=name) for name in OUR_METHODS]
    runs = run_methods(session.samples, setups, session.extrinsics)
    return {name: run.series for name, run in runs.items()}


def _scores(
    runs: Mapping[str, SkeletonSeries], truth: SkeletonSeries
) -> dict[str, dict[str, tuple[float, float]]]:
    """Correlation and error of each angle by each method, on one session."""
    reference = reference_of_skeleton("the truth", truth)
    scores = {}
    for name, series in runs.items():
        angles = score_method(name, series, reference).angles
        scores[name] = {each: (angles[each].r, angles[each].rmse_deg) for each in ANGLES}
    return scores


def _knee_shifts(
    runs: Mapping[str, SkeletonSeries], stamps_ns: IntArray
) -> dict[str, tuple[float, float]]:
    """How often knees' flexion leaves the span of both cameras [%], and its mean shift [°]."""
    flexion = {
        name: np.concatenate([angle_series(series).at(stamps_ns)[knee] for knee in KNEES])
        for name, series in runs.items()
    }
    left, right = flexion["left"], flexion["right"]
    span, middle = np.abs(left - right), 0.5 * (left + right)
    shifts = {}
    for name, found in flexion.items():
        known = np.isfinite(found - middle)
        shift = found[known] - middle[known]
        outside = np.abs(shift) > 0.5 * span[known]
        shifts[name] = (100.0 * float(outside.mean()), float(np.degrees(shift.mean())))
    return shifts
