"""Accuracy on captured motion with simulated sensors: methods, runs, scores.

One time shift of each method against the truth is removed (docs/accuracy/README.md). The baseline
is ``joint_kf`` on the same samples with the true extrinsics and clocks. The first seconds, in which
bodies are measured, are not evaluated; those in which IMUs are aligned are.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from pose_bench.captured_suite import KNOWN
from pose_calibration.body_measures import measure_body
from pose_calibration.session_calibration import calibrate
from pose_core.api import (
    Clock,
    Extrinsics,
    ImuSample,
    Pipeline,
    PipelineParameters,
    SkeletonSample,
    SkeletonSeries,
    extrinsics_from_map,
    run_first_pass,
)
from pose_core.errors import PoseError
from pose_core.estimators.default import DefaultEstimator
from pose_core.filter.tuning import FilterTuning
from pose_evaluation.offline import MethodRun, MethodSetup, run_pipeline, tracked_series
from pose_evaluation.scores import MethodScores, score_method
from pose_evaluation.uncertainty import mean_coverage, uncertainty_coverage
from pose_io.references.reference import Reference, reference_of_skeleton
from pose_sim.captured.clip import RATE
from pose_sim.captured.session import (
    SENSORS,
    START_NS,
    CapturedSession,
    CapturedSpec,
    make_captured_session,
    stamp_of,
)

BASELINE = "joint_kf"
"""Baseline of all ratios; it uses the true extrinsics and clock offsets."""
EVALUATED_FROM_S = 3.0  # [s]


@dataclass(frozen=True, kw_only=True)
class CapturedMethod(MethodSetup):
    """A method: an estimator with its inputs and tuning."""

    estimator: str = "default"
    segments: tuple[str, ...] = ()  # segments whose IMUs are used; empty: all
    tuning: FilterTuning | None = None  # of the default estimator; None: the default


METHODS = (
    CapturedMethod(name="left", estimator="left"),
    CapturedMethod(name="right", estimator="right"),
    CapturedMethod(name="mean", estimator="mean"),
    CapturedMethod(name=BASELINE, estimator=BASELINE),
    CapturedMethod(name="dof_kf", estimator="dof_kf"),
    CapturedMethod(name="li2020", estimator="li2020"),
    CapturedMethod(name="zhang2015", estimator="zhang2015", use_imus=True),
    CapturedMethod(name="imu", estimator="imu", use_imus=True),
    CapturedMethod(name="default"),
    CapturedMethod(name="default+imus", use_imus=True),
    CapturedMethod(name="smoothed", estimator="smoothed"),
    CapturedMethod(name="smoothed+imus", estimator="smoothed", use_imus=True),
)


@dataclass(frozen=True, kw_only=True)
class CapturedScore:
    """Figures of one method on one session; ratios are to the baseline's; NaN if undefined."""

    source: str  # of the clips: the name of their folder
    session: str
    trackers: str
    condition: str
    method: str
    rmse_deg: float = np.nan
    hip_knee_deg: float = np.nan
    r: float = np.nan
    mpjpe_mm: float = np.nan
    lag_ms: float = np.nan
    tracker_delay_ms: float = np.nan  # mean of the two cameras'
    jerk: float = np.nan
    rmse_ratio: float = np.nan
    mpjpe_ratio: float = np.nan
    within_1: float = np.nan  # share of the angles' errors within 1 published deviation
    within_2: float = np.nan  # and within 2
    imus: int = 0  # number of IMUs with samples
    imus_used: int = 0  # at the end
    imu_from_s: float = np.nan  # [s] after the session's start, median time of alignment
    error: str = ""  # reason for missing figures


def truth_of(session: CapturedSession, start_ns: int = START_NS) -> SkeletonSeries:
    """The captured joints, as of a session that starts at ``start_ns``."""
    positions = session.clip.positions
    times_s = np.arange(len(positions)) / RATE
    return tracked_series(start_ns + np.rint(times_s * 1e9).astype(np.int64), positions)


def true_extrinsics(session: CapturedSession) -> Extrinsics:
    """The true poses and clock offsets of the cameras."""
    placed = extrinsics_from_map(session.T_map_sensor)
    late_ns = round(session.spec.clock_offset_s * 1e9)
    return replace(placed, clocks={SENSORS[1]: Clock(offset_ns=late_ns)} if late_ns else {})


def known_extrinsics(session: CapturedSession, *, imus: bool) -> Extrinsics | PoseError:
    """Extrinsics by the session's condition: the true ones, or calibrated from its samples.

    The body is measured over the whole session in both cases, as ``./pose fuse`` does.

    Args:
        session: The session.
        imus: Whether the calibration uses the IMUs.
    """
    samples = session.samples(imus=imus)
    if session.spec.condition == KNOWN:
        skeletons = [each for each in samples if isinstance(each, SkeletonSample)]
        return replace(true_extrinsics(session), body=measure_body(skeletons))
    try:
        return calibrate(samples, SENSORS).extrinsics
    except PoseError as error:
        return error


def run_session(spec: CapturedSpec, methods: Sequence[CapturedMethod]) -> list[CapturedScore]:
    """Simulate a session, run methods on it and score them; failures have the reason."""
    session = make_captured_session(spec)
    whole = truth_of(session)
    evaluated = whole.between(stamp_of(EVALUATED_FROM_S), int(whole.stamps_ns[-1]))
    if not len(evaluated):
        error = f"too short: judged from {EVALUATED_FROM_S:g} s on"
        return [replace(_unscored(spec, method), error=error) for method in methods]
    truth = reference_of_skeleton("the truth", evaluated, synthetic=True)
    baseline_method = next(method for method in METHODS if method.name == BASELINE)
    baseline_run = run_method(session, baseline_method, true_extrinsics(session))
    baseline = score_method(BASELINE, baseline_run[0].series, truth)
    known = {
        imus: known_extrinsics(session, imus=imus)
        for imus in {method.use_imus for method in methods}
    }
    found = []
    for method in methods:
        score, extrinsics = _unscored(spec, method), known[method.use_imus]
        try:
            if method.name == BASELINE:
                made, pipeline = baseline_run
            elif isinstance(extrinsics, PoseError):
                raise PoseError(f"not calibrated: {extrinsics}")
            else:
                made, pipeline = run_method(session, method, extrinsics)
        except PoseError as error:
            found.append(replace(score, error=str(error)))
            continue
        if not len(made.series):
            found.append(replace(score, error="no estimates"))
            continue
        figures = _figures(made, truth, baseline)
        if method.use_imus:
            figures |= _imu_figures(pipeline)
        found.append(replace(score, **figures))
    return found


def run_method(
    session: CapturedSession, method: CapturedMethod, extrinsics: Extrinsics
) -> tuple[MethodRun, Pipeline]:
    """Run a method over a session's samples, in the order of their arrival."""
    parameters = PipelineParameters(
        estimator=method.estimator, use_imus=method.use_imus, sensors=SENSORS
    )
    make = partial(DefaultEstimator, tuning=method.tuning) if method.tuning else None
    samples = [
        each
        for each in session.samples(imus=method.use_imus)
        if not isinstance(each, ImuSample) or not method.segments or each.segment in method.segments
    ]
    parameters, alignments = run_first_pass(samples, extrinsics, parameters, make)
    pipeline = Pipeline(parameters, extrinsics, make_estimator=make)
    pipeline.use_sensor_to_segment(alignments)
    return run_pipeline(pipeline, samples), pipeline


def _unscored(spec: CapturedSpec, method: CapturedMethod) -> CapturedScore:
    return CapturedScore(
        source=spec.clips[0].parent.name,
        session=spec.name,
        trackers="/".join(spec.trackers),
        condition=spec.condition,
        method=method.name,
        tracker_delay_ms=1000.0 * spec.mean_delay_s,
    )


def _figures(run: MethodRun, truth: Reference, baseline: MethodScores) -> dict[str, Any]:
    """A method's figures, by the fields of a score."""
    scores = score_method("", run.series, truth)
    within = mean_coverage(uncertainty_coverage(run.estimates, truth.angles, scores.shift_s))
    return {
        "rmse_deg": scores.mean_rmse_deg,
        "hip_knee_deg": scores.mean_leg_rmse_deg,
        "r": scores.mean_r,
        "mpjpe_mm": scores.mpjpe_mm,
        "lag_ms": 1000.0 * scores.shift_s,
        "jerk": scores.mean_jerk,
        "rmse_ratio": scores.mean_rmse_deg / baseline.mean_rmse_deg,
        "mpjpe_ratio": scores.mpjpe_mm / baseline.mpjpe_mm,
        "within_1": within.within_1,
        "within_2": within.within_2,
    }


def _imu_figures(pipeline: Pipeline) -> dict[str, Any]:
    uses = pipeline.imu_uses
    begin_ns = stamp_of(0.0)
    since = [(use.aligned_ns - begin_ns) * 1e-9 if use.aligned_ns else np.inf for use in uses]
    return {
        "imus": len(uses),
        "imus_used": sum(not use.reason for use in uses),
        "imu_from_s": float(np.median(since)) if since else np.nan,
    }
