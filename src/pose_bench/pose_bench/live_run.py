"""One run of the whole graph in real processes: latency at the arrival, load and memory."""

import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pose_bench.processes import Usages, generate_session, latency_probe, sleep_until, usages
from pose_core.arrays import FloatArray
from pose_core.errors import InputError
from pose_core.stamps import NS_PER_S
from pose_fusion.launched_graph import LaunchedGraph
from pose_fusion.watching.stages import reported_stages

LEAD_S = 12.0  # [s] from the session's start to its first frame, for the start of all processes
STEADY_S = 18.0  # [s] until calibration, body measures and alignment of IMUs are complete
SIMULATED = ("imu_device",)  # not part of the graph: replaces the real IMUs


@dataclass(frozen=True, kw_only=True)
class LiveResult:
    """Figures of one run."""

    latency_ms: FloatArray  # (n,) from a joint state's stamp to its arrival
    missing: int  # stamps of the output grid without a joint state
    stages: Mapping[str, str]  # median and 99th percentile [ms] by stage, as the fusion reports
    load: dict[str, float]  # [cores] by process
    memory_mb: dict[str, float]  # [MB] by process


def run_live(duration_s: float, folder: Path) -> LiveResult:
    """Run the demo's graph on a synthetic session and measure it by a probe.

    Args:
        duration_s: Duration of the session [s].
        folder: Folder for the session, the bag and the log.

    Returns:
        Latencies, load and memory of its steady part.

    Raises:
        PoseError: If the duration is too short, the graph fails, or it gives no joint states.
    """
    if duration_s < STEADY_S + 5.0:
        raise InputError(f"duration = {duration_s:g} s: expected {STEADY_S + 5.0:g} s or more")
    session = folder / "session"
    making_s = 0.2 * duration_s + 5.0
    start_ns = time.time_ns() + round((making_s + LEAD_S) * NS_PER_S)
    generate_session(session, "leg_lift_march", duration_s, start_ns)
    arguments = {"session": str(session), "bag": str(folder / "bag"), "start_at": str(start_ns)}
    steady_ns = start_ns + round(STEADY_S * NS_PER_S)
    with (
        latency_probe() as arrived,
        LaunchedGraph("demo.launch.yaml", arguments, folder / "graph.log") as graph,
    ):
        sleep_until(steady_ns)
        graph.check()
        before = usages(graph.pid)
        sleep_until(start_ns + round((duration_s - 1.0) * NS_PER_S))
        graph.check()
        after = usages(graph.pid)
        graph.stop()
    stages: dict[str, str] = {}
    for node in graph.nodes.values():
        stages |= reported_stages(node.values)
    return _result(arrived, stages, steady_ns, before, after)


def latencies(arrived: Mapping[str, int], steady_ns: int) -> tuple[FloatArray, FloatArray]:
    """Latency of each joint state [ms], and the steps of their stamps in median steps.

    Args:
        arrived: Arrivals [ns] by stamp [ns], as the probe prints them.
        steady_ns: Stamp of the first evaluated joint state [ns].

    Raises:
        InputError: If there are less than two.
    """
    found = sorted((int(stamp), at_ns) for stamp, at_ns in arrived.items())
    stamps, arrivals = np.array([each for each in found if each[0] >= steady_ns]).reshape(-1, 2).T
    if len(stamps) < 2:
        raise InputError("no joint states came: see the graph's log")
    steps = np.diff(stamps)
    return (arrivals - stamps).astype(np.float64) * 1e-6, steps / np.median(steps)


def _result(
    arrived: Mapping[str, int],
    stages: Mapping[str, str],
    steady_ns: int,
    before: Usages,
    after: Usages,
) -> LiveResult:
    latency_ms, steps = latencies(arrived, steady_ns)
    seconds = after.at_s - before.at_s
    return LiveResult(
        latency_ms=latency_ms,
        missing=int(np.sum(np.rint(steps) - 1)),
        stages=stages,
        load={
            name: (cpu_s - before.cpu_s.get(name, 0.0)) / seconds
            for name, cpu_s in after.cpu_s.items()
            if name not in SIMULATED
        },
        memory_mb={n: size for n, size in after.memory_mb.items() if n not in SIMULATED},
    )
