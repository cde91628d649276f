"""One line of live progress while the demo's graph runs."""

import time

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn
from rich.table import Column

from pose_core.stamps import NS_PER_S
from pose_fusion.launched_graph import LaunchedGraph
from pose_node.node_status import NodeStatus

TAIL_S = 1.5  # [s] for processing and recording the last frames
POLL_S = 0.2  # [s]
PLAIN_LINE_S = 10.0  # [s] between lines without a terminal


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
            time.sleep(POLL_S)


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
