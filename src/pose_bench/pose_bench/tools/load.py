"""``./pose bench load``: the live graph with many sensors or people; memory over time."""

import argparse
import os
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import Console

from pose_bench.faults.messages import Planned, planned
from pose_bench.live_run import latencies
from pose_bench.nodes.fault_player import FaultPlayer
from pose_bench.options import add_list
from pose_bench.processes import Usages, latency_probe, usages
from pose_bench.repeated_messages import LOOP_NS, in_loop
from pose_bench.speed import machine
from pose_bench.tools.load_scenes import SCENES, LoadScene
from pose_bench.tools.replayed_graph import await_graph, start_graph
from pose_bench.tools.showing import publish
from pose_core.arrays import FloatArray
from pose_core.errors import InputError
from pose_core.stamps import NS_PER_S
from pose_evaluation.table import Table, number, table_of
from pose_fusion.own_domain import use_own_domain
from pose_node.child_process import stop
from pose_node.command_line import add_option

SUMMARY = "the live graph with many sensors or people: latency, losses, memory over time"
LEAD_NS = 4 * NS_PER_S  # [ns] until the first message
STEADY_S = 20.0  # [s] after the first message; until then, people are measured and IMUs aligned
PERIOD_S = 10.0  # [s] between measurements of the memory


@dataclass(frozen=True, kw_only=True)
class LoadResult:
    """Figures of one scene."""

    scene: str
    latency_ms: FloatArray  # (n,) from a joint state's stamp to its arrival in another process
    missing: float  # [-] share of the output's instants without a joint state
    rmse_deg: float  # [deg] of the subject's twelve angles; NaN without a truth
    lost: int  # messages, as the fusion and the recorder report
    said: bool  # whether a warning in /diagnostics named the losses
    cores: float  # [-] load of all processes of the graph
    memory_mb: dict[str, list[float]]  # [MB] of each process, every PERIOD_S from STEADY_S on
    late_ms: float  # [ms] largest delay of the replay
    machine_load: float  # [-] average of the last minute, at the end


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    add_list(parser, "--scene", list(SCENES), "what the graph is given", choices=SCENES)
    add_option(parser, "--loops", 1, "of the 64 s of each scene", "N")


def run(arguments: argparse.Namespace) -> int:
    """Measure and print; 1 if a graph ended, or losses were not reported."""
    results = []
    use_own_domain(Console(stderr=True))
    for name in arguments.scene:
        with tempfile.TemporaryDirectory(prefix="pose_bench_load_") as folder:
            results.append(run_scene(SCENES[name](), arguments.loops, Path(folder)))
    publish([_table(results), _memory(results)], "Load", arguments.output, "load.md")
    return 1 if any(result.lost and not result.said for result in results) else 0


def run_scene(scene: LoadScene, loops: int, folder: Path) -> LoadResult:
    """Replay a scene to a graph of real processes.

    Raises:
        InputError: If the graph does not start, or a process of it ends.
    """
    messages = [planned(packet) for packet in scene.packets]
    player = FaultPlayer()
    player.open(messages)
    sensors = f"[{', '.join(scene.T_map_sensor)}]"
    max_people = str(scene.max_people)
    graph = start_graph(folder, scene.T_map_sensor, sensors=sensors, max_people=max_people)
    try:
        with latency_probe() as arrived:
            await_graph(player, graph, folder)
            before_ns = time.time_ns()
            _plan(messages, before_ns)
            preparing_ns = 2 * loops * (time.time_ns() - before_ns)  # on a busy machine
            begin_ns = time.time_ns() + LEAD_NS + preparing_ns
            plans = [_plan(messages, begin_ns + loop * LOOP_NS) for loop in range(loops)]
            measured = _replay(player, plans, begin_ns, graph.pid)
            log = (folder / "graph.log").read_text()
            if graph.poll() is not None or "has died" in log:
                raise InputError(f"the graph ended, or a process of it: {log[-500:]}")
            heard = player.heard()
    finally:
        stop(graph)
        player.close()
    steady_ns = begin_ns + round(STEADY_S * NS_PER_S)
    begin, end = measured[0], measured[-1]
    latency_ms, steps = latencies(arrived, steady_ns)
    steps = np.rint(steps[steps < 50.0])  # the pause between loops is longer
    last = {said.name: said for said in heard.said}
    counts = [last[node].values for node in ("/fusion", "/recorder") if node in last]
    names = ("messages_lost", "lost_messages")
    return LoadResult(
        scene=scene.name,
        latency_ms=latency_ms,
        missing=float(np.sum(steps - 1.0) / np.sum(steps)),
        rmse_deg=scene.rmse_deg(heard.bodies.between(steady_ns, begin_ns + LOOP_NS), begin_ns),
        lost=sum(int(values.get(name, 0)) for values in counts for name in names),
        said=any("lost" in said.message for said in heard.said),
        cores=(sum(end.cpu_s.values()) - sum(begin.cpu_s.values())) / (end.at_s - begin.at_s),
        memory_mb={
            name: [each.memory_mb[name] for each in measured if name in each.memory_mb]
            for name in end.memory_mb
        },
        late_ms=1e3 * player.latest_s,
        machine_load=os.getloadavg()[0],
    )


def _plan(messages: Sequence[Planned], begin_ns: int) -> list[Planned]:
    """The messages of a loop from ``begin_ns`` on."""
    return [(at_s, topic, kind, in_loop(d, begin_ns)) for at_s, topic, kind, d in messages]


def _replay(
    player: FaultPlayer, plans: Sequence[list[Planned]], begin_ns: int, root: int
) -> list[Usages]:
    """Publish the messages, loop after loop, and measure the graph's processes."""
    measured: list[Usages] = []
    times = np.arange(STEADY_S, len(plans) * LOOP_NS / NS_PER_S - 1.0, PERIOD_S)
    for loop, plan in enumerate(plans):
        loop_ns = begin_ns + loop * LOOP_NS
        first_s = loop * LOOP_NS / NS_PER_S
        until_s = LOOP_NS / NS_PER_S - 1.0  # of two seconds without messages
        due = times[(times >= first_s) & (times < first_s + until_s)] - first_s
        acts = [(at_s, lambda: measured.append(usages(root))) for at_s in due.tolist()]
        player.play(plan, acts, loop_ns, until_s)
    return measured


def _table(results: list[LoadResult]) -> Table:
    return table_of(
        "Load",
        "scene",
        ((one.scene, one) for one in results),
        {
            "median [ms]": lambda one: number(np.median(one.latency_ms), 1),
            "99 %": lambda one: number(np.percentile(one.latency_ms, 99.0), 1),
            "largest": lambda one: number(one.latency_ms.max(), 1),
            "missing [%]": lambda one: number(100.0 * one.missing, 2),
            "lost": lambda one: str(one.lost),
            "RMSE [°]": lambda one: number(one.rmse_deg, 1),
            "cores": lambda one: number(one.cores, 2),
            "replay late [ms]": lambda one: number(one.late_ms, 0),
            "machine's load": lambda one: number(one.machine_load, 1),
        },
        "Age of a joint state at its arrival in another process; instants of the output "
        "without one; messages lost on the way to fusion and recorder. Real processes of "
        f"calibration, fusion and recorder. {machine()}.",
    )


def _memory(results: list[LoadResult]) -> Table:
    return table_of(
        "Memory [MB] of each process",
        "scene, process",
        (
            (f"{one.scene}: {process}", sizes)
            for one in results
            for process, sizes in sorted(one.memory_mb.items())
        ),
        {
            f"after {STEADY_S:g} s": lambda sizes: number(sizes[0], 1),
            "middle": lambda sizes: number(sizes[len(sizes) // 2], 1),
            "end": lambda sizes: number(sizes[-1], 1),
        },
    )
