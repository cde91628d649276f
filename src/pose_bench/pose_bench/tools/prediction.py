"""``./pose bench prediction``: benefit of predicting the pose to the current time.

Every ten milliseconds the pose is requested. The result is either the last output, unchanged, or
the state predicted to the current time; both are compared with the truth at that time.
"""

import argparse
from collections.abc import Iterator

import numpy as np
from rich.console import Console

from pose_bench.options import add_list
from pose_bench.sessions import BenchSession, SessionSpec, bench_session
from pose_bench.tools.showing import publish
from pose_core.api import (
    BodyEstimate,
    Pipeline,
    PipelineParameters,
    SkeletonSample,
    angle_series,
    wrapped,
)
from pose_core.errors import InputError
from pose_evaluation.offline import tracked_series
from pose_evaluation.table import Table, number_row
from pose_node.command_line import add_option

SUMMARY = "the pose predicted to now against the last output, both against the truth of now"
SEED = 101  # that no parameter was tuned on


def prediction_errors(session: BenchSession, *, use_imus: bool) -> tuple[float, float]:
    """Process a session in the order of arrival, and predict to each instant of the truth.

    Returns:
        RMSE [deg] over all instants, mean over the angles: of the last output, of the prediction.
    """
    parameters = PipelineParameters(
        sensors=session.extrinsics.sensors, use_imus=use_imus, output_rate=0.0
    )
    pipeline = Pipeline(parameters, session.extrinsics, is_live=True)
    truth = session.evaluated_truth
    stamps_ns = truth.stamps_ns.tolist()
    asked = list(_asked(session, pipeline, stamps_ns, use_imus))
    if not asked:
        raise InputError("no instant to judge: expected a longer --duration")
    rows = np.searchsorted(truth.stamps_ns, [now_ns for now_ns, _, _ in asked])
    now_ns = truth.stamps_ns[rows]
    true = angle_series(truth).at(now_ns)

    def error_deg(poses: list[BodyEstimate]) -> float:
        series = tracked_series(now_ns, np.array([pose.joints for pose in poses]))
        found = angle_series(series).at(now_ns)
        errors = [wrapped(found[name] - true[name]) for name in true]
        return float(np.degrees(np.mean([np.sqrt(np.nanmean(error**2)) for error in errors])))

    held, predicted = [h for _, h, _ in asked], [p for _, _, p in asked]
    return error_deg(held), error_deg(predicted)


def _asked(
    session: BenchSession, pipeline: Pipeline, stamps_ns: list[int], use_imus: bool
) -> Iterator[tuple[int, BodyEstimate, BodyEstimate]]:
    """Time [ns], last output and prediction, at each instant with both."""
    last: BodyEstimate | None = None
    arriving = iter(zip(session.arrivals_ns, session.samples, strict=True))
    arrival_ns, sample = next(arriving)
    for now_ns in stamps_ns:
        while arrival_ns <= now_ns:
            if use_imus or isinstance(sample, SkeletonSample):
                estimates = pipeline.add(sample)
                last = estimates[-1] if estimates else last
            arrival_ns, sample = next(arriving, (2**63, sample))
        predicted = pipeline.predict(now_ns)
        if last is not None and predicted is not None:
            yield now_ns, last, predicted


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    motions = ["leg_lift_march", "kicks", "dance"]
    add_list(parser, "--choreographies", motions, "motions of the synthetic subject", "NAME")
    add_option(parser, "--duration", 30.0, "of each session [s]", "S")


def run(arguments: argparse.Namespace) -> int:
    """Measure and print."""
    rows = []
    for name in arguments.choreographies:
        spec = SessionSpec(
            choreography=name, level="typical", seed=SEED, duration_s=arguments.duration
        )
        with Console(stderr=True).status(f"predicting {name}"):
            session = bench_session(spec)
            for use_imus in (False, True):
                held, predicted = prediction_errors(session, use_imus=use_imus)
                label = f"{name}, two Kinects{', nine IMUs' if use_imus else ''}"
                rows.append(number_row(label, (held, predicted, predicted / held), 2))
    table = Table(
        caption="Error against the truth of now [°], mean over the angles",
        head="",
        columns=["last output", "predicted", "ratio"],
        rows=rows,
        note="Synthetic subject, asked every 10 ms, nothing shifted in time: without IMUs most of "
        "the error is the trackers' own delay.",
    )
    publish([table], "Prediction", arguments.output, "prediction.md")
    return 0
