"""Estimation over the samples of a whole recording."""

import warnings
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np

from pose_core.estimates.body_estimates import BodyEstimate
from pose_core.estimators.parameters import PipelineParameters
from pose_core.estimators.registry import estimator_class
from pose_core.filter.tracker_errors import MAX_DELAY_S
from pose_core.fusion.alignment_history import AlignmentHistory
from pose_core.fusion.estimator_runner import EstimatorMaker
from pose_core.fusion.pipeline import Pipeline
from pose_core.fusion.sample_check import check_samples
from pose_core.imu.sensor_to_segment import SensorsToSegments
from pose_core.kernels.compiling import announce_compilation
from pose_core.session.extrinsics import Extrinsics
from pose_core.streams.estimate_series import EstimateSeries, estimate_series
from pose_core.streams.recording_order import in_order
from pose_core.streams.repeated_frames import RepeatedFrames
from pose_core.streams.samples import ImuBlock, ImuSample, SkeletonSample


def fuse(
    samples: Iterable[SkeletonSample | ImuSample | ImuBlock],
    extrinsics: Extrinsics,
    parameters: PipelineParameters | None = None,
) -> EstimateSeries:
    """Estimate one person's pose over a recording.

    Args:
        samples: Samples of all sensors, in the order of arrival or of their stamps.
        extrinsics: Poses of the sensors and their clocks.
        parameters: The estimator and its settings; if None, the default one with these sensors.

    Returns:
        Degrees of freedom over time with standard deviations; no rows if there was no pose.

    Raises:
        InputError: If the samples have other shapes, units or names than expected, or stamps go
            back by more than a second.

    Warns:
        UserWarning: If frames were left out, since their sensor repeats one frame.
    """
    announce_compilation()
    samples = list(samples)
    check_samples(samples, extrinsics, None if parameters is None else parameters.sensors)
    samples = _without_repeated_frames(samples)
    parameters = parameters or PipelineParameters(sensors=extrinsics.sensors)
    parameters, alignments = run_first_pass(samples, extrinsics, parameters)
    pipeline = Pipeline(parameters, extrinsics)
    pipeline.use_sensor_to_segment(alignments)
    estimates = [
        estimate
        for sample in in_order(samples, extrinsics.clocks)
        for estimate in pipeline.add(sample)
    ]
    return series_of_estimates([*estimates, *pipeline.flush()])


def _without_repeated_frames(
    samples: Sequence[SkeletonSample | ImuSample | ImuBlock],
) -> Sequence[SkeletonSample | ImuSample | ImuBlock]:
    """The samples, of which no tracker has measured some, named in a warning."""
    repeated, counts = RepeatedFrames(), Counter[str]()
    kept: list[SkeletonSample | ImuSample | ImuBlock] = []
    for sample in samples:
        if isinstance(sample, SkeletonSample) and repeated.is_frozen(sample.sensor, [sample]):
            counts[sample.sensor] += 1
        else:
            kept.append(sample)
    for sensor, count in counts.items():
        warnings.warn(
            f"{count} frames of sensor '{sensor}' repeat the one before and are left out",
            stacklevel=3,
        )
    return kept


Parameters = TypeVar("Parameters", bound=PipelineParameters)


def first_pass(parameters: Parameters) -> Parameters | None:
    """Parameters of a first pass over a recording; None if one pass suffices.

    The sensor-to-segment alignments that the default estimator finds for the recording's beginning
    let the second pass use the IMUs from there on, and the delay of the trackers that it measures
    is the second's prior mean.
    """
    if not (estimator_class(parameters.estimator).ALIGNS_IMUS and parameters.use_imus):
        return None
    return replace(parameters, estimator="default", output_rate=0.0)


def run_first_pass(
    samples: Sequence[SkeletonSample | ImuSample | ImuBlock],
    extrinsics: Extrinsics,
    parameters: Parameters,
    make_estimator: EstimatorMaker | None = None,
) -> tuple[Parameters, SensorsToSegments]:
    """Run the :func:`first_pass` over one person's recording, if it has IMUs' samples to align.

    Arguments are those of a :class:`~pose_core.fusion.pipeline.Pipeline`.

    Returns:
        Parameters of the second pass, and the alignments at the recording's beginning.
    """
    before = first_pass(parameters)
    if before is None or all(isinstance(each, SkeletonSample) for each in samples):
        return parameters, {}
    pipeline = Pipeline(before, extrinsics, make_estimator=make_estimator)
    history = AlignmentHistory()
    for sample in in_order(samples, extrinsics.clocks):
        pipeline.add(sample)
        history.note(pipeline)
        if history.is_complete:
            break
    return with_measured_delay(parameters, pipeline), history.initial(pipeline)


def with_measured_delay(parameters: Parameters, first: Pipeline) -> Parameters:
    """Parameters with the mean delay of the trackers that ``first`` has measured, unless given."""
    delays = np.array(list(first.tracker_delays_s.values())).reshape(-1, 2)
    if parameters.tracker_delay > 0.0 or not len(delays):
        return parameters
    weight = delays[:, 1] ** -2.0
    mean_s = float(weight @ delays[:, 0] / weight.sum())
    return replace(parameters, tracker_delay=min(max(mean_s, 0.0), MAX_DELAY_S))


def series_of_estimates(estimates: Sequence[BodyEstimate]) -> EstimateSeries:
    """Convert estimates to arrays."""
    return estimate_series(
        estimates,
        estimates[0].dof_names if estimates else (),
        stamps_ns=[each.stamp_ns for each in estimates],
        sources=[each.source for each in estimates],
        latencies_s=[(each.newest_ns - each.stamp_ns) * 1e-9 for each in estimates],
    )
