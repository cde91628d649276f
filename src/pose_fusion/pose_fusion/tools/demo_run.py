"""A run of the demo: the start of its input after all nodes are up, and its progress."""

import os
import shutil
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn
from rich.table import Column

from pose_core.stamps import NS_PER_S
from pose_fusion.launched_graph import DiagnosticsReader, LaunchedGraph
from pose_node.node_status import NodeStatus

PROCESSES = 8  # started together: launcher, bridges, devices, calibration, fusion, recorder
WEIGHT = 3.0  # [-] start-up time of a node of the graph relative to the measured process
FUSION_WEIGHT = 10.0  # [-] that of the fusion, which loads its kernels
REPORT_S = 1.0  # [s] until a started node reports in /diagnostics
SPARE_S = 1.0  # [s] smallest time between the last node's first report and the first frame
MAX_LEAD_S = 60.0  # [s]
POLL_S = 0.1  # [s]
TAIL_S = 1.5  # [s] for processing and recording the last frames
SHOWN_S = 0.2  # [s] between reports of the progress
PLAIN_LINE_S = 10.0  # [s] between lines without a terminal

Prepare = Callable[[float], tuple[int, dict[str, str]]]
"""Function of a lead [s] that returns the input's start [ns] and the launch file's arguments,
but for the start and the recorded bag."""


@dataclass(frozen=True, kw_only=True)
class DemoRun:
    """A finished run of the graph."""

    folder: Path
    subject: str  # description of the subject
    nodes: Mapping[str, NodeStatus]  # the last report of each node

    @property
    def bag(self) -> Path:
        """The recorded bag."""
        return self.folder / "bag"


def first_lead_s() -> float:
    """Expected start-up time of all processes [s], from that of one."""
    begin = time.monotonic()
    monitor = DiagnosticsReader()
    try:
        monitor.is_ready.wait(MAX_LEAD_S)
        one_s = time.monotonic() - begin
    finally:
        monitor.stop()
    rounds = max(1.0, PROCESSES / len(os.sched_getaffinity(0)))
    return min(MAX_LEAD_S, SPARE_S + REPORT_S + (FUSION_WEIGHT + WEIGHT * rounds) * one_s)


def ready_estimator(console: Console) -> None:
    """Compile the estimator if needed, which takes longer than the time limit of nodes."""
    with console.status("preparing the estimator; it is compiled at the first start on a machine"):
        from pose_core.api import (
            Pipeline,
            PipelineParameters,  # takes a second to load
        )
        from pose_io.preparing import prepare_reading

        Pipeline(PipelineParameters())
        prepare_reading()


@contextmanager
def started_graph(
    launch_file: str, prepare: Prepare, folder: Path, lead_s: float, console: Console
) -> Iterator[tuple[LaunchedGraph, int]]:
    """Start a graph whose nodes are all up before its input starts.

    If they are not, the graph is restarted with twice the time, up to a minute; after that the
    input starts anyway, and the missing nodes are named.

    Args:
        launch_file: The graph.
        prepare: Prepares the input.
        folder: Folder for bag and log.
        lead_s: Initial time limit of the nodes [s].
        console: Console for messages.

    Yields:
        The running graph, and the input's start [ns].
    """
    while True:
        start_at_ns, arguments = prepare(lead_s)
        arguments |= {"bag": str(folder / "bag"), "start_at": str(start_at_ns)}
        with LaunchedGraph(launch_file, arguments, folder / "graph.log") as graph:
            missing = wait_until_up(graph, start_at_ns - round(SPARE_S * NS_PER_S), console)
            if not missing or lead_s >= MAX_LEAD_S:
                if missing:
                    console.print(f"not up when the input begins: {', '.join(missing)}")
                yield graph, start_at_ns
                return
        lead_s = min(2.0 * lead_s, MAX_LEAD_S)
        console.print(f"{', '.join(missing)}: not up yet; starting again, with {lead_s:.0f} s")
        shutil.rmtree(folder / "bag", ignore_errors=True)


def wait_until_up(graph: LaunchedGraph, deadline_ns: int, console: Console) -> list[str]:
    """Wait until every node has reported to ``/diagnostics``; returns the missing nodes.

    Raises:
        GraphError: If the graph fails.
    """
    planned = graph.planned_nodes()
    with console.status("starting") as status:
        while True:
            up = {name.split("/")[-1] for name in graph.nodes}
            missing = [name for name in planned if name not in up]
            graph.check()
            if not missing or time.time_ns() >= deadline_ns:
                return missing
            count = len(planned) - len(missing)
            status.update(f"starting: {count} of {len(planned)} nodes are up")
            time.sleep(POLL_S)


def watch(graph: LaunchedGraph, start_at_ns: int, duration_s: float, console: Console) -> None:
    """Show the graph's progress until its input has ended.

    Args:
        graph: The running graph.
        start_at_ns: Start of its input [ns].
        duration_s: Duration of its input [s].
        console: Console for the progress.

    Raises:
        GraphError: If the graph fails.
    """
    columns = (
        TextColumn("{task.description}", table_column=Column(no_wrap=True, min_width=8)),
        BarColumn(bar_width=24),
        TextColumn("{task.completed:.0f}/{task.total:.0f} s  {task.fields[counts]}"),
    )
    next_line_s = 0.0
    with Progress(*columns, console=console, transient=True) as progress:
        task = progress.add_task("starting", total=duration_s, counts="")
        while True:
            passed_s = (time.time_ns() - start_at_ns) / NS_PER_S
            shown_s = min(max(passed_s, 0.0), duration_s)
            graph.check()
            description, counts = describe(graph.nodes, passed_s, duration_s)
            progress.update(task, completed=shown_s, description=description, counts=counts)
            if not console.is_terminal and passed_s >= next_line_s:
                next_line_s += PLAIN_LINE_S
                console.print(f"{description} {shown_s:.0f}/{duration_s:.0f} s  {counts}")
            if passed_s > duration_s + TAIL_S:
                return
            time.sleep(SHOWN_S)


def describe(nodes: dict[str, NodeStatus], passed_s: float, duration_s: float) -> tuple[str, str]:
    """Current phase, and the counts so far.

    Args:
        nodes: The last report of each node, by name.
        passed_s: Time [s] since the input's start; negative before.
        duration_s: Duration [s] of the input.
    """
    if passed_s < 0.0:
        return f"starting, {len(nodes)} nodes are up", ""
    frames = sum(node.count("frames_published") for node in nodes.values())
    out = sum(node.count("estimates") for node in nodes.values())
    # At the end silent devices are expected.
    is_over = passed_s > duration_s
    complaints = [
        f"{name.lstrip('/')}: {node.message}"
        for name, node in nodes.items()
        if node.level and not is_over
    ]
    counts = f"frames in {frames}, joint states out {out}, warnings {len(complaints)}"
    if complaints:
        counts += f" ({complaints[0]})"
    return "stopping" if is_over else "running", counts
