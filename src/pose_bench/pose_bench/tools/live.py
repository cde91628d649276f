"""``./pose bench live``: the whole graph in real processes, watched from outside."""

import argparse
import tempfile
from pathlib import Path

import numpy as np
from rich.console import Console

from pose_bench.live_run import LiveResult, run_live
from pose_bench.speed import machine
from pose_bench.tools.showing import publish
from pose_evaluation.table import Table, number, number_row, table_of, text_row
from pose_node.command_line import add_option

SUMMARY = "the whole graph in real processes: latency, load, memory, missing joint states"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    add_option(parser, "--duration", 60.0, "of the session [s]", "S")


def run(arguments: argparse.Namespace) -> int:
    """Measure and print."""
    with (
        tempfile.TemporaryDirectory(prefix="pose_bench_live_") as folder,
        Console(stderr=True).status(f"running the graph for {arguments.duration:g} s"),
    ):
        result = run_live(arguments.duration, Path(folder))
    tables = [_latency_table(result), _cost_table(result)]
    publish(tables, "Live", arguments.output, "live.md")
    return 0


def _latency_table(result: LiveResult) -> Table:
    values = np.percentile(result.latency_ms, [50.0, 99.0, 100.0]).tolist()
    rows = [number_row("stamp of a joint state to its arrival in another process", values, 1)]
    for stage, text in result.stages.items():
        median, _, p99 = text.partition(", p99 ")
        rows.append(text_row(f"a frame: {stage.replace('_', ' ')}", median, p99, ""))
    return Table(
        caption="Latency [ms]",
        head="",
        columns=["median", "99 %", "most"],
        rows=rows,
        note=f"{len(result.latency_ms)} joint states; {result.missing} instants of the output grid "
        "without one. Stages: the last ten seconds of the reference camera's frames, from the "
        "fusion's diagnostics; the last stage includes the wait for the next instant of the grid. "
        "Two Kinects at 30 Hz, nine IMUs at 100 Hz, synthetic, with recorder and calibration. "
        f"{machine()}.",
    )


def _cost_table(result: LiveResult) -> Table:
    rows = [(name, (result.load[name], result.memory_mb[name])) for name in sorted(result.load)]
    rows.append(("all", (sum(result.load.values()), sum(result.memory_mb.values()))))
    return table_of(
        "The graph's processes, without the virtual IMUs' device",
        "",
        rows,
        {
            "load [cores]": lambda one: number(one[0], 2),
            "memory [MB]": lambda one: number(one[1], 0),
        },
        "Memory: what a process has for itself, and its share of what several use.",
    )
