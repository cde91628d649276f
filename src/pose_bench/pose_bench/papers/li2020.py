"""li2020's tables 1 to 4: two motions, six angles; printed and measured figures."""

from collections.abc import Sequence
from dataclasses import dataclass

from pose_bench.sessions import SessionSpec, bench_session
from pose_core.finite_numbers import mean_known
from pose_evaluation.offline import MethodSetup, run_methods
from pose_evaluation.scores import score_method
from pose_evaluation.table import Table, number_row

ANGLES = (
    "right_hip_flexion",
    "left_hip_flexion",
    "right_hip_abduction",
    "left_hip_abduction",
    "right_knee_flexion",
    "left_knee_flexion",
)
PRINTED_METHODS = ("Kinect 1", "Kinect 2", "Moon", "li2020")
OUR_METHODS = ("left", "right", "joint_kf", "dof_kf", "li2020", "default")


@dataclass(frozen=True, kw_only=True)
class PaperMotion:
    """One of the paper's two motions, and the choreography that replaces it."""

    title: str
    choreography: str
    r: tuple[tuple[float, ...], ...]  # (6, 4) [-] as printed, in the order of the names above
    error: tuple[tuple[float, ...], ...]  # (6, 4) [°] as printed


MOTIONS = (
    PaperMotion(
        title="side leg lift, then jumps (tables 1, 2)",
        choreography="leg_lift_jump",
        r=(
            (0.811, 0.818, 0.868, 0.890),
            (0.828, 0.814, 0.850, 0.871),
            (0.829, 0.904, 0.911, 0.918),
            (0.721, 0.590, 0.731, 0.719),
            (0.644, 0.541, 0.707, 0.738),
            (0.833, 0.896, 0.893, 0.874),
        ),
        error=(
            (13.1, 13.9, 13.0, 11.6),
            (21.8, 22.6, 22.1, 21.4),
            (7.6, 9.8, 7.4, 7.5),
            (7.1, 10.7, 8.3, 8.4),
            (18.0, 21.3, 17.3, 16.9),
            (14.4, 15.3, 14.4, 14.4),
        ),
    ),
    PaperMotion(
        title="side leg lift, then marching on the spot (tables 3, 4)",
        choreography="leg_lift_march",
        r=(
            (0.369, 0.749, 0.753, 0.719),
            (0.548, 0.691, 0.742, 0.761),
            (0.425, 0.552, 0.519, 0.655),
            (0.714, 0.284, 0.643, 0.650),
            (0.334, 0.157, 0.409, 0.400),
            (0.126, 0.250, 0.300, 0.479),
        ),
        error=(
            (40.5, 35.3, 28.7, 29.7),
            (18.0, 20.4, 17.8, 16.8),
            (14.3, 12.6, 10.6, 9.2),
            (18.1, 21.9, 19.6, 19.5),
            (67.3, 83.7, 65.0, 63.3),
            (39.8, 50.5, 32.6, 30.0),
        ),
    ),
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
    sensors = session.extrinsics.sensors
    scores = {}
    for name, run in run_methods(session.samples, setups, sensors, session.extrinsics).items():
        angles = score_method(name, run.series, session.evaluated_truth).angles
        scores[name] = {each: (angles[each].r, angles[each].rmse_deg) for each in ANGLES}
    return scores
