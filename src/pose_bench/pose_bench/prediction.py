"""What predicting to the moment of publication is worth: error against the truth of that moment.

Every ten milliseconds somebody asks for the pose of now. Told is either the last output, as it
stands, or the state predicted to now.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from pose_bench.sessions import BenchSession
from pose_core.api import (
    BodyEstimate,
    FloatArray,
    FusionParameters,
    FusionPipeline,
    ImuSample,
    SkeletonSample,
    SkeletonSeries,
    angle_series,
)
from pose_core.errors import InputError
from pose_core.joints import JOINTS, TrackingState


@dataclass(frozen=True, kw_only=True)
class PredictionErrors:
    """Of one session, over all instants at which the truth is known."""

    held_deg: float  # RMSE [deg] of the last output, mean over the angles
    predicted_deg: float  # the same of the prediction
    held_stddev_deg: float  # the published standard deviation [deg], median
    predicted_stddev_deg: float
    age_ms: float  # how old the last output is [ms], median


def prediction_errors(session: BenchSession, *, use_imus: bool) -> PredictionErrors:
    """Feed a session as it arrives, and ask for now at each instant of the judged truth."""
    parameters = FusionParameters(
        sensors=session.extrinsics.sensors, use_imus=use_imus, output_rate=0.0
    )
    pipeline = FusionPipeline(parameters, session.extrinsics)
    truth = session.judged_truth
    stamps_ns = truth.stamps_ns.tolist()
    asked = [each for each in _asked(session, pipeline, stamps_ns, use_imus) if each is not None]
    if not asked:
        raise InputError("no instant to judge: expected a longer --duration")
    rows = np.searchsorted(truth.stamps_ns, [now_ns for now_ns, _, _ in asked])
    now_ns = truth.stamps_ns[rows]
    true = angle_series(truth).at(now_ns)

    def error_deg(poses: list[BodyEstimate]) -> float:
        series = SkeletonSeries(
            stamps_ns=now_ns,
            positions=np.array([pose.joints for pose in poses]),
            tracking_state=np.full((len(poses), len(JOINTS)), TrackingState.TRACKED, np.uint8),
        )
        told = angle_series(series).at(now_ns)
        turns = [np.remainder(told[n] - true[n] + np.pi, 2.0 * np.pi) - np.pi for n in true]
        return float(np.degrees(np.mean([np.sqrt(np.nanmean(turn**2)) for turn in turns])))

    held, predicted = [h for _, h, _ in asked], [p for _, _, p in asked]
    age_ns = now_ns - np.array([pose.stamp_ns for pose in held])
    return PredictionErrors(
        held_deg=error_deg(held),
        predicted_deg=error_deg(predicted),
        held_stddev_deg=_stddev_deg(held),
        predicted_stddev_deg=_stddev_deg(predicted),
        age_ms=float(np.median(age_ns)) * 1e-6,
    )


def _asked(
    session: BenchSession, pipeline: FusionPipeline, stamps_ns: list[int], use_imus: bool
) -> Iterator[tuple[int, BodyEstimate, BodyEstimate] | None]:
    """Now [ns], the last output and the prediction, at each instant at which there are both."""
    last: BodyEstimate | None = None
    arriving = iter(zip(session.arrivals_ns, session.samples, strict=True))
    arrival_ns, sample = next(arriving)
    for now_ns in stamps_ns:
        while arrival_ns <= now_ns:
            for estimate in _fed(pipeline, sample, use_imus):
                last = estimate
            arrival_ns, sample = next(arriving, (2**63, sample))
        predicted = pipeline.predict(now_ns)
        yield None if last is None or predicted is None else (now_ns, last, predicted)


def _fed(
    pipeline: FusionPipeline, sample: SkeletonSample | ImuSample, use_imus: bool
) -> list[BodyEstimate]:
    return pipeline.add(sample) if use_imus or isinstance(sample, SkeletonSample) else []


def _stddev_deg(poses: list[BodyEstimate]) -> float:
    stddev: FloatArray = np.array([pose.position_stddev[6:] for pose in poses])
    return float(np.degrees(np.nanmedian(stddev)))
