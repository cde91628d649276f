"""``./pose bench captured``: every method on captured motion with simulated sensors."""

import argparse
import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from rich.console import Console

from pose_bench.captured import METHODS, CapturedMethod, CapturedScore, run_session
from pose_bench.captured_suite import caption, captured_specs
from pose_bench.captured_tables import captured_csv, source_table, summary_table
from pose_bench.captured_variants import ablation_methods, imu_set_methods
from pose_bench.options import add_jobs_argument, add_list, add_motion_argument
from pose_bench.pool import run_all
from pose_bench.tools.showing import publish
from pose_core.api import PipelineParameters
from pose_core.errors import InputError
from pose_core.joints import SEGMENTS
from pose_core.parameters import specs as parameter_specs
from pose_node.command_line import add_flag, add_option
from pose_sim.captured.imus import ImuModel
from pose_sim.captured.session import CapturedSpec

SUMMARY = "how accurate the estimators are on captured motion with simulated sensors"
SEED = 101
MAX_JOBS = 2
MIN_RATE = 10.0  # [Hz] below which no IMU is used
BY_SOURCE = ("default", "default+imus")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    add_motion_argument(parser)
    add_flag(parser, "--tuning", "the trackers for tuning, instead of those for evaluation")
    what = parser.add_mutually_exclusive_group()
    what.add_argument(
        "--methods", nargs="+", choices=[method.name for method in METHODS], help="(default: all)"
    )
    add_flag(what, "--imu-sets", "instead: the default estimator with 0 to 15 IMUs")
    add_flag(what, "--ablation", "instead: the default estimator, each time without one part")
    parser.add_argument(
        "--sessions", type=int, metavar="N", help="N of the sessions, evenly spread (default: all)"
    )
    swing = "standard deviation of the IMUs' headings in uneven magnetic fields"
    add_option(parser, "--disturbance", 0.0, swing, "DEG")
    add_flag(parser, "--uneven", "every tracker at 15 to 30 Hz, unevenly, instead of some")
    add_flag(parser, "--no-magnetometer", "the IMUs' headings are unknown and drift by 0.3°/s")
    rates = "rate of the IMUs; several alternate from segment to segment"
    add_list(parser, "--imu-rates", ImuModel().rates, rates, "HZ")
    add_option(parser, "--seed", SEED, "of everything random", "N")
    add_jobs_argument(parser, MAX_JOBS)


def run(arguments: argparse.Namespace) -> int:
    """Run the suite; the status is 1 if a method failed anywhere."""
    chosen = chosen_specs(arguments)
    methods = chosen_methods(arguments)
    calls = [(spec, methods) for spec in chosen]
    found = run_all(run_session, calls, jobs=arguments.jobs, name="sessions")
    scores = [score for each in found for score in each]
    tables = [summary_table(scores, caption(chosen))]
    if not (arguments.imu_sets or arguments.ablation):
        tables.append(source_table(scores, BY_SOURCE))
    rows = {"captured.csv": captured_csv(scores)}
    publish(tables, SUMMARY, arguments.output, "captured.md", **rows)
    return _report_failures(scores)


def chosen_specs(arguments: argparse.Namespace) -> list[CapturedSpec]:
    """The sessions that the options ask for."""
    folders: Sequence[Path | None] = arguments.motion or [None]
    every: list[CapturedSpec] = []
    for folder in folders:
        held_out, seed = not arguments.tuning, arguments.seed
        every += captured_specs(folder, held_out=held_out, seed=seed, first=len(every))
    if min(arguments.imu_rates) < MIN_RATE:
        raise InputError(f"imu_rates = {arguments.imu_rates}: expected {MIN_RATE:g} Hz or more")
    imu = ImuModel(
        rates=tuple(arguments.imu_rates),
        disturbance=math.radians(arguments.disturbance),
        has_magnetometer=not arguments.no_magnetometer,
    )
    every = [replace(spec, imu=imu, uneven=arguments.uneven) for spec in every]
    if arguments.imu_sets:
        every = [replace(spec, worn=SEGMENTS) for spec in every]
    if arguments.sessions is None:
        return every
    if not 1 <= arguments.sessions <= len(every):
        raise InputError(f"sessions = {arguments.sessions}: expected 1 to {len(every)}")
    return [every[i * len(every) // arguments.sessions] for i in range(arguments.sessions)]


def chosen_methods(arguments: argparse.Namespace) -> tuple[CapturedMethod, ...]:
    """The methods that the options ask for, of which there is an estimator."""
    if arguments.imu_sets:
        return imu_set_methods()
    if arguments.ablation:
        return ablation_methods()
    there = parameter_specs(PipelineParameters)["estimator"][1].choices or ()
    wanted = arguments.methods or [method.name for method in METHODS]
    return tuple(m for m in METHODS if m.name in wanted and m.estimator in there)


def _report_failures(scores: Sequence[CapturedScore]) -> int:
    console = Console(stderr=True)
    for score in scores:
        if score.error:
            line = f"failed: {score.method} on {score.source}, {score.session}: {score.error}"
            console.print(line, style="red", markup=False, soft_wrap=True)
    return int(any(score.error for score in scores))
