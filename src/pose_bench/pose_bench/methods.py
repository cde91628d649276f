"""The compared methods, and running them over a session's samples."""

import time
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from pose_bench.sessions import BenchSession
from pose_core.api import (
    BodyEstimate,
    Extrinsics,
    FloatArray,
    FusionParameters,
    FusionPipeline,
    ImuSample,
    SkeletonSample,
)
from pose_core.parameters import specs
from pose_evaluation.offline import MethodRun, MethodSetup, run_of_estimates

BASELINE = "joint_kf"
"""Baseline of all ratios; it uses the true extrinsics and clock offset."""


@dataclass(frozen=True, kw_only=True)
class Method(MethodSetup):
    """An estimator with its inputs."""

    true_extrinsics: bool = False  # whether it uses the true ones instead of calibrated ones


METHODS: tuple[Method, ...] = (
    Method(name="left", estimator="left"),
    Method(name="right", estimator="right"),
    Method(name="mean", estimator="mean"),
    Method(name=BASELINE, estimator="joint_kf", true_extrinsics=True),
    Method(name="dof_kf", estimator="dof_kf"),
    Method(name="li2020", estimator="li2020"),
    Method(name="zhang2015", estimator="zhang2015", use_imus=True),
    Method(name="default", estimator="default"),
    Method(name="default+imus", estimator="default", use_imus=True),
    Method(name="imu", estimator="imu", use_imus=True),
    Method(name="smoothed", estimator="smoothed"),
    Method(name="smoothed+imus", estimator="smoothed", use_imus=True),
)
"""Methods in the order of the tables."""


@dataclass(frozen=True, kw_only=True)
class TimedRun(MethodRun):
    """Result of a method on a session, with its cost; n estimates."""

    latency_s: FloatArray  # (n,) [s] from the estimated instant to the sample that completed it
    cpu_s: float  # [s] spent in the estimator


def available_methods() -> tuple[Method, ...]:
    """The methods whose estimator is installed."""
    choices = specs(FusionParameters)["estimator"][1].choices or ()
    return tuple(m for m in METHODS if m.estimator in choices)


def run_method(method: Method, session: BenchSession, extrinsics: Extrinsics) -> TimedRun:
    """Run a method over a session, sample by sample as they arrive.

    Args:
        method: The method.
        session: The session.
        extrinsics: Poses and clocks of the sensors, as known to the method.
    """
    sensors = extrinsics.sensors
    parameters = FusionParameters(
        estimator=method.estimator, use_imus=method.use_imus, sensors=sensors
    )
    samples = [
        (arrival_ns, sample)
        for arrival_ns, sample in zip(session.arrivals_ns, session.samples, strict=True)
        if (method.use_imus or not isinstance(sample, ImuSample))
    ]
    return run_pipeline(FusionPipeline(parameters, extrinsics), samples)


def run_pipeline(
    pipeline: FusionPipeline, samples: Iterable[tuple[int, SkeletonSample | ImuSample]]
) -> TimedRun:
    """Run a pipeline over samples with their arrivals [ns]."""
    made: list[tuple[int, BodyEstimate]] = []
    arrival_ns = 0
    begin = time.process_time()
    for arrival_ns, sample in samples:
        made += [(arrival_ns, estimate) for estimate in pipeline.add(sample)]
    made += [(arrival_ns, estimate) for estimate in pipeline.flush()]
    cpu_s = time.process_time() - begin
    run = run_of_estimates([estimate for _, estimate in made])
    latencies_s = [(arrival_ns - estimate.stamp_ns) * 1e-9 for arrival_ns, estimate in made]
    return TimedRun(
        series=run.series,
        estimates=run.estimates,
        latency_s=np.array(latencies_s, np.float64),
        cpu_s=cpu_s,
    )
