"""``./pose bench``: speed, live, offline and prediction in one run, against their goals."""

import argparse
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from statistics import median

import numpy as np
from rich.console import Console

from pose_bench import speed
from pose_bench.live_run import LiveResult, run_live
from pose_bench.processes import latency_probe
from pose_bench.sessions import SessionSpec, bench_session
from pose_bench.tools.offline import fuse_cost
from pose_bench.tools.prediction import SEED, prediction_errors
from pose_bench.tools.showing import show
from pose_core.errors import InputError
from pose_core.stamps import NS_PER_S
from pose_evaluation.table import Row, Table, number, text_row
from pose_fusion.launched_graph import launch, up_command
from pose_node.child_process import executable, run_to_end, stop
from pose_node.command_line import add_option

PROBE_S = 4.0  # [s] until the probe has started
WATCHED_S = 12.0  # [s] duration of the graph's run
PARAMETERS = "/**:\n  ros__parameters:\n    extrinsics_file: {}\n"
SUMMARY = "all of speed, live, offline and prediction against their goals, in one table"
STARTS = 3
LIVE_S = 45.0  # [s] of the live session
FUSED_S = 7200.0  # [s] of the live session's bag, repeated, for the offline run


def first_state_s(session: Path, bag: Path, folder: Path) -> float:
    """Time to the first joint state with known extrinsics and body measures.

    Args:
        session: Folder of a synthetic session.
        bag: Its recording, which has extrinsics and body measures.
        folder: Folder for the files and the log.

    Returns:
        Time [s] from the command's start to the arrival of the first joint state.

    Raises:
        PoseError: If none arrived.
    """
    known, parameters = folder / "extrinsics.yaml", folder / "start_fusion.yaml"
    if not known.exists():
        run_to_end([executable("pose_fusion", "calibrate"), bag, "-o", known])
    parameters.write_text(PARAMETERS.format(known))
    arguments = {
        "recording": str(session / "kinects.csv"),
        "format": "csv",
        "sensor_left": "left",
        "sensor_right": "right",
        "view": "false",
        "record": "false",
        "bag": str(folder / "nothing"),
        "extrinsics_file": str(known),
        "params": str(parameters),
    }
    with latency_probe() as arrived:
        time.sleep(PROBE_S)
        begin_ns = time.time_ns()
        graph = launch(up_command("capture.launch.yaml", arguments), folder / "start.log")
        try:
            time.sleep(WATCHED_S)
        finally:
            stop(graph)
    if not arrived:
        raise InputError(f"no joint state came within {WATCHED_S:g} s: see {folder}/start.log")
    return (min(arrived.values()) - begin_ns) / NS_PER_S


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    add_option(parser, "--live-duration", LIVE_S, "of the live session [s]", "S")
    what = "of the bag that is fused: the live session's, repeated [s]"
    add_option(parser, "--fuse-duration", FUSED_S, what, "S")


def run(arguments: argparse.Namespace) -> int:
    """Measure all and print one table."""
    rows: list[Row] = []
    note = (
        f"{speed.FRAMES} repeats of an update, {speed.SLOW_FRAMES} of filterpy's, CPU time of one "
        f"thread; live: {arguments.live_duration:g} s in real processes; fuse: that bag repeated, "
        f"start-up included. Synthetic motion. {speed.machine()}."
    )
    with (
        tempfile.TemporaryDirectory(prefix="pose_bench_goals_") as name,
        Console(stderr=True).status("measuring one update") as status,
    ):
        folder = Path(name)
        rows += _of_updates()
        status.update("measuring how the cost grows")
        rows += _of_growth()
        status.update(f"running the graph for {arguments.live_duration:g} s")
        rows += _of_live(run_live(arguments.live_duration, folder))
        status.update("starting the graph")
        rows += _of_start(folder)
        status.update("fusing the recorded bag, repeated")
        repeats = max(1, round(arguments.fuse_duration / arguments.live_duration))
        rows += _of_fuse(folder / "bag", repeats)
        status.update("predicting to now")
        rows += _of_prediction()
    columns = ["measured", "goal", ""]
    show([Table(caption="Goals", head="", columns=columns, rows=rows, note=note)])
    return 0


def _row(what: str, measured: float, goal: float, digits: int, *, at_least: bool = False) -> Row:
    is_met = measured >= goal if at_least else measured <= goal
    sign = "≥" if at_least else "≤"
    verdict = "met" if is_met else "missed"
    return text_row(what, number(measured, digits), f"{sign} {goal:g}", verdict)


def _of_updates() -> Iterator[Row]:
    timings = {
        timing.name: timing for timing in speed.update_timings(speed.FRAMES, speed.SLOW_FRAMES)
    }
    textbook, whole = timings[speed.TEXTBOOK].median_ms, timings[speed.WHOLE]
    yield _row("update with nine IMUs, median [ms]", whole.median_ms, 0.5, 3)
    yield _row("update with nine IMUs, 99 % [ms]", whole.p99_ms, 1.0, 3)
    faster = "times faster than filterpy"
    yield _row(f"that update, {faster}", textbook / whole.median_ms, 50.0, 1, at_least=True)
    li2020 = timings["li2020, two Kinects"].median_ms
    yield _row(f"li2020, {faster}", textbook / li2020, 40.0, 1, at_least=True)
    for name in (speed.OPENSIM, "joint_kf, two Kinects", speed.TEXTBOOK):
        if name not in timings:
            yield text_row(name, "the package is not installed", "", "")
        else:
            median_ms = number(timings[name].median_ms, 3)
            yield text_row(f"for comparison: {name} [ms]", median_ms, "", "")


def _of_growth() -> Iterator[Row]:
    for what, points in speed.growth(speed.GROWTH_FRAMES).items():
        yield _row(f"exponent of the cost by number of {what}", speed.exponent(points), 1.1, 2)


def _of_live(result: LiveResult) -> Iterator[Row]:
    half, p99 = np.percentile(result.latency_ms, [50.0, 99.0]).tolist()
    yield _row("a joint state's stamp to its arrival, median [ms]", half, 3.0, 1)
    yield _row("a joint state's stamp to its arrival, 99 % [ms]", p99, 10.0, 1)
    yield _row("the whole graph's load [cores]", sum(result.load.values()), 0.8, 2)
    yield _row("the whole graph's memory [MB]", sum(result.memory_mb.values()), 700.0, 0)
    missing = f"instants without a joint state, of {len(result.latency_ms) + result.missing}"
    yield _row(missing, float(result.missing), 0.0, 0)


def _of_start(folder: Path) -> Iterator[Row]:
    name = f"up to the first joint state, median of {STARTS} starts [s]"
    starts = [first_state_s(folder / "session", folder / "bag", folder) for _ in range(STARTS)]
    yield _row(name, median(starts), 4.0, 1)


def _of_fuse(bag: Path, repeats: int) -> Iterator[Row]:
    for imus, goal in ((False, 60.0), (True, 33.0)):
        cost = fuse_cost(bag, repeats, imus)
        sensors = "two Kinects and nine IMUs" if imus else "two Kinects"
        name = f"fuse, {sensors}, {cost.duration_s / 60.0:.0f} min"
        times = cost.duration_s / cost.clock_s
        yield _row(f"{name}, times real time", times, goal, 1, at_least=True)
        yield _row(f"{name}, memory [MB]", cost.memory_mb, 300.0, 0)


def _of_prediction() -> Iterator[Row]:
    spec = SessionSpec(choreography="leg_lift_march", level="typical", seed=SEED, duration_s=30.0)
    session = bench_session(spec)
    for use_imus in (False, True):
        held, predicted = prediction_errors(session, use_imus=use_imus)
        name = "two Kinects, nine IMUs" if use_imus else "two Kinects"
        title = f"error predicted to now over last output's, {name}"
        yield _row(title, predicted / held, 1.0, 2)
