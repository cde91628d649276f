"""``./pose bench soak``: a day of live operation in one process, faster than real time."""

import argparse
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import count

import numpy as np
import psutil

from pose_bench.captured import truth_of
from pose_bench.faults.judging import rmse_deg
from pose_bench.repeated_messages import LOOP_NS, in_loop
from pose_bench.replayed_person import captured_person
from pose_bench.speed import machine
from pose_bench.tools.showing import publish
from pose_bench.tools.soak_recording import STEP_NS, steps_of
from pose_bench.tools.soak_session import LiveSession
from pose_core.api import extrinsics_from_map
from pose_evaluation.table import Table, number, table_of
from pose_node.command_line import add_flag, add_option
from pose_sim.captured.session import START_NS

SUMMARY = "a day of live operation in one process: growth of memory, open files, threads; accuracy"
HOUR_NS = 3_600_000_000_000
PERIOD_NS = HOUR_NS // 4  # [ns] between measurements
VISIT_EVERY = 5  # [loops] a second person comes into view in one of so many
MAX_GROWTH = 0.02  # [-] of the memory, from the first hour's end to the end
MAX_RMSE_RATIO = 1.1  # [-] of an hour's RMSE to the first hour's


@dataclass(frozen=True, kw_only=True)
class Measurement:
    """State of the process after a time of the session."""

    hours: float  # [h] of the session
    taken_s: float  # [s] of real time since the start
    memory_mb: float  # [MB] resident
    files: int  # open
    threads: int
    outputs: int  # since the start
    rmse_deg: float  # [deg] of the twelve angles in the last loop of the recording


COLUMNS: dict[str, Callable[[Measurement], str]] = {
    "after [s]": lambda one: number(one.taken_s, 0),
    "memory [MB]": lambda one: number(one.memory_mb, 1),
    "files": lambda one: str(one.files),
    "threads": lambda one: str(one.threads),
    "outputs": lambda one: str(one.outputs),
    "RMSE [°]": lambda one: number(one.rmse_deg, 2),
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    add_option(parser, "--hours", 24.0, "of the session", "H")
    parser.add_argument(
        "--minutes", type=float, default=np.inf, metavar="M", help="end after M real minutes"
    )
    light = "a third of the frames, two IMUs with a quarter of their samples, ten joint states a "
    add_flag(parser, "--light", f"{light}second")


def run(arguments: argparse.Namespace) -> int:
    """Measure and print; 1 if a bound is violated."""
    measured = []
    end_s = time.monotonic() + 60.0 * arguments.minutes
    for measurement in operate(is_light=arguments.light):
        measured.append(measurement)
        cells = (_hours(measurement), *(cell(measurement) for cell in COLUMNS.values()))
        print(" | ".join(cells), flush=True)
        if measurement.hours >= arguments.hours or time.monotonic() > end_s:
            break
    publish([_table(measured, arguments.light)], "Soak", arguments.output, "soak.md")
    broken = broken_bounds(measured)
    if broken:
        print(f"violated: {', '.join(broken)}")
    return 1 if broken else 0


def operate(*, is_light: bool) -> Iterator[Measurement]:
    """Operate without end; yields after each :data:`PERIOD_NS` of the session."""
    person = captured_person()
    alone, visited = steps_of(person, is_light)
    output_rate = 10.0 if is_light else 100.0
    session = LiveSession(extrinsics_from_map(person.T_map_sensor), output_rate)
    process, start_s, due_ns = psutil.Process(), time.monotonic(), PERIOD_NS
    for loop in count():
        begin_ns, end_ns = START_NS + loop * LOOP_NS, (loop + 1) * LOOP_NS
        is_due = end_ns >= due_ns
        session.kept = [] if is_due else None
        for index, messages in enumerate(visited if loop % VISIT_EVERY == 1 else alone):
            shifted = [(source, in_loop(data, begin_ns, loop)) for source, data in messages]
            session.step(shifted, begin_ns + (index + 1) * STEP_NS)
        if not is_due:
            continue
        due_ns += PERIOD_NS
        yield Measurement(
            hours=end_ns / HOUR_NS,
            taken_s=time.monotonic() - start_s,
            memory_mb=process.memory_info().rss / 1e6,
            files=process.num_fds(),
            threads=process.num_threads(),
            outputs=session.outputs,
            rmse_deg=rmse_deg(session.take_kept(), truth_of(person, begin_ns)),
        )
        if session.calibration.is_finished:
            session.calibration.restart()


def broken_bounds(measured: Sequence[Measurement]) -> list[str]:
    """The violated bounds; all are relative to the measurement after the first hour."""
    first = next((one for one in measured if one.hours >= 1.0), measured[0])
    last = measured[-1]
    holds = {
        "memory": last.memory_mb <= (1.0 + MAX_GROWTH) * first.memory_mb,
        "open files": last.files <= first.files,
        "threads": last.threads <= first.threads,
        "RMSE": max(one.rmse_deg for one in measured) <= MAX_RMSE_RATIO * first.rmse_deg,
    }
    return [name for name, does in holds.items() if not does]


def _table(measured: Sequence[Measurement], is_light: bool) -> Table:
    sensors = "two cameras, nine IMUs"
    if is_light:
        sensors = "two cameras at 10 Hz, two IMUs at 25 Hz, ten joint states a second"
    return table_of(
        "Live operation in one process",
        "hours",
        ((_hours(one), one) for one in measured),
        COLUMNS,
        "Fusion and calibration as their nodes drive them, on serialised messages, outputs "
        f"serialised. One captured person of 62 s again and again, {sensors}; an empty "
        "room for 2 s between; a visitor with a new id in every fifth loop; a new calibration each "
        f"quarter of an hour. {machine()}.",
    )


def _hours(one: Measurement) -> str:
    return number(one.hours, 2)
