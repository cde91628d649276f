"""One method's figures on one cell of the accuracy suite."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from pose_bench.methods import TimedRun
from pose_bench.sessions import BenchSession
from pose_bench.suite import Cell
from pose_core.api import ABDUCTION_OF, ANGLES, FloatArray, SkeletonSeries, wrapped
from pose_core.finite_numbers import mean_known
from pose_core.streams.angle_series import SIDEWAYS
from pose_evaluation.offline import MethodRun
from pose_evaluation.scores import score_method
from pose_sim.angles import JOINT_NAMES

HIP_AND_KNEE = tuple(angle for angle in ANGLES if "hip" in angle or "knee" in angle)


@dataclass(frozen=True, kw_only=True)
class Score:
    """One row of the table; NaN where a figure is undefined."""

    cell: Cell
    method: str
    error: str = ""  # reason for missing figures
    rmse_deg: float = np.nan  # [deg] mean over the twelve angles
    hip_knee_rmse_deg: float = np.nan  # [deg] mean over hips and knees
    r: float = np.nan  # [-] mean over the moving angles
    bias_deg: float = np.nan  # [deg] mean absolute bias over the angles
    mpjpe_mm: float = np.nan  # [mm]
    lag_ms: float = np.nan  # [ms] against the truth
    added_lag_ms: float = np.nan  # [ms] beyond that of the raw left Kinect
    latency_ms: float = np.nan  # [ms] from an estimate's instant to the sample that completed it
    instants: float = np.nan  # [-] share of the truth's instants with an estimate
    within_1: float = np.nan  # [-] share of the twelve angles' errors within 1 standard deviation
    within_2: float = np.nan  # [-] within 2
    all_within_1: float = np.nan  # [-] the same over all joints of the body model
    all_within_2: float = np.nan  # [-]
    dof_rmse_deg: float = np.nan  # [deg] of the published degrees of freedom, mean over the twelve
    bone_sd_mm: float = np.nan  # [mm] mean over the bones
    jerk: float = np.nan  # [m/s³] mean over the joints
    cpu_ms: float = np.nan  # [ms] of one estimate
    angle_rmse_deg: Mapping[str, float] = field(default_factory=dict)  # [deg] by angle


def score(cell: Cell, method: str, run: TimedRun, session: BenchSession, raw_lag_s: float) -> Score:
    """Compute a method's figures on a session's choreography.

    Args:
        cell: The cell.
        method: The method's name.
        run: The method's result.
        session: The session, for its ground truth.
        raw_lag_s: Lag of the raw left Kinect [s].
    """
    scores = score_method(method, run.series, session.judged_truth)
    errors = dof_errors(run, session, scores.shift_s, JOINT_NAMES)
    twelve = {name: errors[name] for name in ANGLES if name in errors}
    rmse = {angle: each.rmse_deg for angle, each in scores.angles.items()}
    within, all_within = coverage(twelve), coverage(errors)
    count = len(run.series)
    return Score(
        cell=cell,
        method=method,
        rmse_deg=scores.mean_rmse_deg,
        hip_knee_rmse_deg=mean_known([rmse[angle] for angle in HIP_AND_KNEE]),
        r=scores.mean_r,
        bias_deg=scores.mean_absolute_bias_deg,
        mpjpe_mm=scores.mpjpe_mm,
        lag_ms=1000.0 * scores.shift_s,
        added_lag_ms=1000.0 * (scores.shift_s - raw_lag_s),
        latency_ms=1000.0 * _median(run.latency_s),
        instants=scores.coverage,
        within_1=within[0],
        within_2=within[1],
        all_within_1=all_within[0],
        all_within_2=all_within[1],
        dof_rmse_deg=mean_known([_rms_deg(error) for error, _ in twelve.values()]),
        bone_sd_mm=scores.mean_bone_sd_mm,
        jerk=scores.mean_jerk,
        cpu_ms=1000.0 * run.cpu_s / count if count else np.nan,
        angle_rmse_deg=rmse,
    )


class Truth(Protocol):
    """Ground truth of a session: :class:`BenchSession`, or a captured one."""

    @property
    def truth(self) -> SkeletonSeries:
        """The true skeletons."""

    @property
    def judged_truth(self) -> SkeletonSeries:
        """The evaluated part."""

    @property
    def true_angles(self) -> Mapping[str, FloatArray]:
        """Angles [rad] at the truth's stamps, (n,) each."""


def dof_errors(
    run: MethodRun, session: Truth, shift_s: float, names: Sequence[str]
) -> dict[str, tuple[FloatArray, FloatArray]]:
    """Errors [rad] of published degrees of freedom and their standard deviations [rad], by name.

    At the estimates' instants, after one time shift; flexions are left out where the true limb
    points sideways.
    """
    judged = session.judged_truth.stamps_ns
    estimates = run.estimates
    stamps_ns = estimates.stamps_ns - round(shift_s * 1e9)
    inside = (stamps_ns >= judged[0]) & (stamps_ns <= judged[-1])
    begin_ns = session.truth.stamps_ns[0]  # differences are exact as floats, stamps are not
    times = (stamps_ns[inside] - begin_ns) * 1e-9
    grid = (session.truth.stamps_ns - begin_ns) * 1e-9
    errors = {}
    for name in names:
        if name not in estimates.names:
            continue
        column = estimates.names.index(name)
        true = np.interp(times, grid, session.true_angles[name])
        error = wrapped(estimates.position[inside, column] - true)
        if name in ABDUCTION_OF:
            abduction = np.interp(times, grid, session.true_angles[ABDUCTION_OF[name]])
            error = np.where(np.abs(abduction) > SIDEWAYS, np.nan, error)
        errors[name] = error, estimates.position_stddev[inside, column]
    return errors


def coverage(errors: Mapping[str, tuple[FloatArray, FloatArray]]) -> tuple[float, float]:
    """Shares of the errors within 1 and 2 standard deviations, all angles together."""
    if not errors:
        return np.nan, np.nan
    error, stddev = (np.concatenate(columns) for columns in zip(*errors.values(), strict=True))
    known = np.isfinite(error) & np.isfinite(stddev)
    if not known.any():
        return np.nan, np.nan
    size = np.abs(error[known])
    within_1, within_2 = (float(np.mean(size <= n * stddev[known])) for n in (1.0, 2.0))
    return within_1, within_2


def _median(values: FloatArray) -> float:
    known = values[np.isfinite(values)]
    return float(np.median(known)) if len(known) else np.nan


def _rms_deg(error: FloatArray) -> float:
    return float(np.degrees(np.sqrt(mean_known(error**2))))
