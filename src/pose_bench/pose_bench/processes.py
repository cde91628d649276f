"""CPU time and memory of running processes, from Linux's ``/proc``."""

import os
import time
from dataclasses import dataclass
from pathlib import Path

from pose_core.stamps import NS_PER_S

PROC = Path("/proc")
TICKS_PER_S = os.sysconf("SC_CLK_TCK")


@dataclass(frozen=True, kw_only=True)
class Usage:
    """Usage of one process."""

    name: str  # of its executable
    cpu_s: float  # [s] since its start
    memory_mb: float  # [MB] proportional set size: shared memory is divided


def sleep_until(when_ns: int) -> None:
    """Wait for an instant of the system's clock [ns]."""
    time.sleep(max(0.0, (when_ns - time.time_ns()) / NS_PER_S))


def descendants(root: int) -> list[int]:
    """All direct and indirect children of a process."""
    pids = [int(folder.name) for folder in PROC.glob("[0-9]*")]
    parents = {pid: _parent(pid) for pid in pids}
    found = [root]
    for known in found:  # grows
        found += [pid for pid, parent in parents.items() if parent == known]
    return found[1:]


def usage(pid: int) -> Usage | None:
    """Usage of a process so far; None if it has ended."""
    folder = PROC / str(pid)
    try:
        words = (folder / "cmdline").read_text().split("\0")
        fields = _fields(folder)
        rollup = (folder / "smaps_rollup").read_text()
    except OSError:
        return None
    script = next((Path(w).name for w in words if "/lib/" in w), Path(words[0]).name)
    shared_kb = next(
        int(line.split()[1]) for line in rollup.splitlines() if line.startswith("Pss:")
    )
    return Usage(
        name=script,
        cpu_s=(int(fields[11]) + int(fields[12])) / TICKS_PER_S,
        memory_mb=shared_kb * 1024 / 1e6,
    )


def _parent(pid: int) -> int | None:
    try:
        return int(_fields(PROC / str(pid))[1])
    except OSError:  # the process has ended
        return None


def _fields(folder: Path) -> list[str]:
    """Fields of ``stat`` from the state on: the name before it may contain any characters."""
    return (folder / "stat").read_text().rpartition(")")[2].split()
