"""Processes of a graph under test: their input, latencies, CPU time and memory."""

import json
import subprocess
import sys
import time
from collections import defaultdict
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

import psutil

from pose_core.stamps import NS_PER_S
from pose_node.child_process import executable, run_to_end, start, stop


@dataclass(frozen=True, kw_only=True)
class Usages:
    """Usages of a process and its children, by the names of their executables."""

    at_s: float  # [s] of the monotonic clock
    cpu_s: Mapping[str, float]  # [s] since their start
    memory_mb: Mapping[str, float]  # [MB] proportional set size: shared memory is divided


@contextmanager
def latency_probe() -> Iterator[dict[str, int]]:
    """Run the probe of :mod:`pose_bench.nodes.latency_probe`.

    Yields:
        The arrival [ns] by the stamp [ns] of each joint state, filled at the end.
    """
    arrived: dict[str, int] = {}
    command = [sys.executable, "-m", "pose_bench.nodes.latency_probe"]
    probe = start(command, stdout=subprocess.PIPE)
    try:
        yield arrived
    finally:
        probe.send_signal(2)
        try:
            output, _ = probe.communicate(timeout=20.0)
        except subprocess.TimeoutExpired:
            stop(probe)
            raise
    arrived |= json.loads(output)


def generate_session(path: Path, choreography: str, duration_s: float, start_ns: int) -> None:
    """Write a synthetic session [s] whose time zero is ``start_ns``, as a folder of files."""
    tool: list[str | Path] = [executable("pose_sim", "generate"), "-o", path]
    tool += ["--choreography", choreography, "--duration", f"{duration_s:g}"]
    run_to_end([*tool, "--start-at", str(start_ns)])


def sleep_until(when_ns: int) -> None:
    """Wait for an instant of the system's clock [ns]."""
    time.sleep(max(0.0, (when_ns - time.time_ns()) / NS_PER_S))


def usages(root: int) -> Usages:
    """Usages so far of a process and its direct and indirect children, as far as they run."""
    cpu_s: dict[str, float] = defaultdict(float)
    memory_mb: dict[str, float] = defaultdict(float)
    for process in _family(root):
        with suppress(psutil.Error):  # it has ended
            name, times = _name(process), process.cpu_times()
            memory_mb[name] += process.memory_full_info().pss / 1e6
            cpu_s[name] += times.user + times.system
    return Usages(at_s=time.monotonic(), cpu_s=cpu_s, memory_mb=memory_mb)


def pids_of(root: int, executable: str) -> list[int]:
    """Those of a process and its direct and indirect children that run an executable."""
    found = []
    for process in _family(root):
        with suppress(psutil.Error):  # it has ended
            if _name(process) == executable:
                found.append(process.pid)
    return found


def _family(root: int) -> list[psutil.Process]:
    with suppress(psutil.Error):
        process = psutil.Process(root)
        return [process, *process.children(recursive=True)]
    return []


def _name(process: psutil.Process) -> str:
    """Name of a process's executable, or of the script that an interpreter runs."""
    words = process.cmdline()
    return next((Path(word).name for word in words if "/lib/" in word), process.name())
