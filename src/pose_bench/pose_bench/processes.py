"""CPU time and memory of running processes, from Linux's ``/proc``."""

import os
import time
from contextlib import suppress
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


def usages(root: int) -> list[Usage]:
    """Usages so far of a process and its direct and indirect children, as far as they run."""
    return [found for found in map(_usage, [root, *_descendants(root)]) if found is not None]


def pids_of(root: int, executable: str) -> list[int]:
    """The direct and indirect children of a process that run an executable."""
    found = []
    for pid in _descendants(root):
        with suppress(OSError):  # it has ended
            if _name(PROC / str(pid)) == executable:
                found.append(pid)
    return found


def _descendants(root: int) -> list[int]:
    """All direct and indirect children of a process."""
    pids = [int(folder.name) for folder in PROC.glob("[0-9]*")]
    parents = {pid: _parent(pid) for pid in pids}
    found = [root]
    for known in found:  # grows
        found += [pid for pid, parent in parents.items() if parent == known]
    return found[1:]


def _usage(pid: int) -> Usage | None:
    """Usage of a process so far; None if it has ended."""
    folder = PROC / str(pid)
    try:
        name = _name(folder)
        fields = _fields(folder)
        rollup = (folder / "smaps_rollup").read_text()
    except OSError:
        return None
    shared_kb = next(
        int(line.split()[1]) for line in rollup.splitlines() if line.startswith("Pss:")
    )
    return Usage(
        name=name,
        cpu_s=(int(fields[11]) + int(fields[12])) / TICKS_PER_S,
        memory_mb=shared_kb * 1024 / 1e6,
    )


def _name(folder: Path) -> str:
    """Name of a process's executable, or of the script that an interpreter runs."""
    words = (folder / "cmdline").read_text().split("\0")
    return next((Path(word).name for word in words if "/lib/" in word), Path(words[0]).name)


def _parent(pid: int) -> int | None:
    try:
        return int(_fields(PROC / str(pid))[1])
    except OSError:  # the process has ended
        return None


def _fields(folder: Path) -> list[str]:
    """Fields of ``stat`` from the state on: the name before it may contain any characters."""
    return (folder / "stat").read_text().rpartition(")")[2].split()
