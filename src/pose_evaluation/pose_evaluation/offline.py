"""Runs estimators over one recording's raw streams, all in one pass."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pose_core.api import (
    BodyEstimate,
    EstimateSeries,
    Extrinsics,
    FloatArray,
    ImuBlock,
    ImuSample,
    IntArray,
    Pipeline,
    PipelineParameters,
    SkeletonSample,
    SkeletonSeries,
    in_order,
    series_of_estimates,
)
from pose_core.joints import JOINTS, TrackingState
from pose_core.parameters import specs
from pose_evaluation.methods import MEAN

IMU_ALONE = "imu"
RAW = (MEAN, "left", "right")  # estimators without a filter, which the tables already contain
NEED_IMUS = (IMU_ALONE, "zhang2015")  # estimators that are run with the IMUs only
WITH_IMUS = ("default", "ukf")  # estimators that are run with the IMUs, too
ALIASES = ("ukf",)  # another name of the default
IMU_ENDING = "+imus"


@dataclass(frozen=True, kw_only=True)
class MethodSetup:
    """A method: an estimator with its inputs."""

    name: str  # in the tables
    estimator: str  # value of the fusion's parameter
    use_imus: bool = False


@dataclass(frozen=True, kw_only=True)
class MethodRun:
    """Result of one method."""

    series: SkeletonSeries  # joints in map
    estimates: EstimateSeries  # its degrees of freedom
    imus: tuple[str, ...] = ()  # lines about IMUs that are not used, silent or wrong
    unused_imus: tuple[str, ...] = ()  # segments whose IMU is not used, though it is heard


def known_setups(*, has_imus: bool) -> tuple[MethodSetup, ...]:
    """All estimators without IMUs, the best ones with IMUs, and the IMUs alone.

    Args:
        has_imus: Whether the recording contains IMUs; otherwise no method uses them.
    """
    _, spec = specs(PipelineParameters)["estimator"]
    setups = []
    # The default last, as in the tables of the papers: each method after those that it improves.
    for name in sorted(spec.choices or (), key=_rank):
        if name in RAW or (name in NEED_IMUS and not has_imus):
            continue
        setups.append(MethodSetup(name=name, estimator=name, use_imus=name in NEED_IMUS))
        if has_imus and name in WITH_IMUS:
            setups.append(MethodSetup(name=name + IMU_ENDING, estimator=name, use_imus=True))
    return tuple(setups)


def run_methods(
    samples: Iterable[SkeletonSample | ImuSample | ImuBlock],
    setups: Sequence[MethodSetup],
    extrinsics: Extrinsics,
) -> dict[str, MethodRun]:
    """Run estimators side by side over the same samples.

    Args:
        samples: Samples of all sensors; they are used in the order of their stamps.
        setups: The methods to run.
        extrinsics: Poses of the Kinects.

    Returns:
        Results by name; a method without poses has an empty series.

    Raises:
        ParameterError: If a setup cannot use the recording's sensors.
    """
    pipelines = {
        setup.name: Pipeline(
            PipelineParameters(
                estimator=setup.estimator, use_imus=setup.use_imus, sensors=extrinsics.sensors
            ),
            extrinsics,
        )
        for setup in setups
    }
    with_imus = {setup.name: pipelines[setup.name] for setup in setups if setup.use_imus}
    estimates: dict[str, list[BodyEstimate]] = {name: [] for name in pipelines}
    for sample in in_order(samples, extrinsics.clocks):
        takers = pipelines if isinstance(sample, SkeletonSample) else with_imus
        for name, pipeline in takers.items():
            estimates[name] += pipeline.add(sample)
    for name, pipeline in pipelines.items():
        estimates[name] += pipeline.flush()
    return {
        name: replace(
            run_of_estimates(estimates[name]),
            imus=tuple(f"IMU {use}" for use in pipeline.imu_uses if use.reason or use.remark),
            unused_imus=tuple(use.segment for use in pipeline.imu_uses if use.reason),
        )
        for name, pipeline in pipelines.items()
    }


def run_pipeline(pipeline: Pipeline, samples: Iterable[SkeletonSample | ImuSample]) -> MethodRun:
    """Run a pipeline over a recording's samples, in the order of their stamps."""
    ordered = in_order(samples, pipeline.clocks)
    estimates = [estimate for sample in ordered for estimate in pipeline.add(sample)]
    return run_of_estimates([*estimates, *pipeline.flush()])


def run_of_estimates(estimates: Sequence[BodyEstimate]) -> MethodRun:
    """Convert estimates to arrays; of those with equal stamps, the first one's joints are used."""
    stamps_ns = np.array([each.stamp_ns for each in estimates], np.int64)
    stamps_ns, rows = np.unique(stamps_ns, return_index=True)
    joints = np.array([estimates[row].joints for row in rows.tolist()])
    return MethodRun(
        # The model gives every joint, tracked or not.
        series=tracked_series(stamps_ns, joints.reshape(-1, len(JOINTS), 3)),
        estimates=series_of_estimates(estimates),
    )


def tracked_series(stamps_ns: IntArray, positions: FloatArray) -> SkeletonSeries:
    """A series in which all joints are tracked: stamps [ns], (n,), positions [m], (n, 15, 3)."""
    state = np.full(positions.shape[:2], TrackingState.TRACKED, np.uint8)
    return SkeletonSeries(stamps_ns=stamps_ns, positions=positions, tracking_state=state)


def _rank(name: str) -> int:
    order = ("joint_kf", "dof_kf", "li2020", "default", IMU_ALONE)
    return order.index(name) if name in order else len(order) - 2
