"""li2020's tables 1 to 4: two motions, six angles; printed and measured figures."""

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pose_bench.sessions import SessionSpec, bench_session
from pose_core.arrays import FloatArray
from pose_core.finite_numbers import mean_known
from pose_evaluation.offline import MethodSetup, run_methods
from pose_evaluation.scores import score_method
from pose_evaluation.table import Table, number_row
from pose_io.references.reference import reference_of_skeleton

LEG_ANGLES = ("hip_flexion", "hip_abduction", "knee_flexion")
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
    """Correlations and errors of one motion; measured ones are means over levels and seeds."""
    found = [_scores(motion.choreography, level, seed) for level in levels for seed in seeds]
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
    return tables


def _scores(choreography: str, level: str, seed: int) -> dict[str, dict[str, tuple[float, float]]]:
    """Correlation and error of each angle by each method, on one session."""
    session = bench_session(
        SessionSpec(choreography=choreography, level=level, seed=seed), imus=False
    )
    setups = [MethodSetup(name=name, estimator=name) for name in OUR_METHODS]
    truth = reference_of_skeleton("the truth", session.evaluated_truth)
    scores = {}
    for name, run in run_methods(session.samples, setups, session.extrinsics).items():
        angles = score_method(name, run.series, truth).angles
        scores[name] = {each: (angles[each].r, angles[each].rmse_deg) for each in ANGLES}
    return scores
