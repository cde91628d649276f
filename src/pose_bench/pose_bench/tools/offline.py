"""``./pose bench offline BAG``: how fast ``fuse`` is, and how much memory it takes."""

import argparse
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console

from pose_bench.repeated_bag import repeat
from pose_bench.speed import machine
from pose_bench.tables import TextTable, number
from pose_bench.tools.showing import document, output_folder, show
from pose_common.bags import open_bag
from pose_common.errors import InputError
from pose_fusion.tools.demo_processes import executable

SUMMARY = "how fast ./pose fuse is on bags of several lengths, and how much memory it takes"
MB = 1e6
WATCH = """
import resource, subprocess, sys
null = subprocess.DEVNULL
status = subprocess.run(sys.argv[1:], stdout=null, stderr=null).returncode
used = resource.getrusage(resource.RUSAGE_CHILDREN)
print(used.ru_utime + used.ru_stime, used.ru_maxrss)
sys.exit(status)
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument("bag", type=Path, help="of some ten seconds, as ./pose demo leaves one")
    parser.add_argument(
        "--times",
        type=int,
        nargs="+",
        default=[1, 10],
        metavar="N",
        help="how often it is repeated, for each of the bags to make (1 10)",
    )
    parser.add_argument("-o", "--output", type=Path, metavar="DIR", help="folder for offline.md")


def run(arguments: argparse.Namespace) -> int:
    """Measure and print."""
    table = TextTable(
        title="./pose fuse, start-up included",
        header=["", "CPU time [s]", "times real time (CPU)", "(clock)", "peak memory [MB]"],
        note=f"{machine()}. The bag repeated, its IMUs left out or not.",
    )
    for imus in (False, True):
        for times in arguments.times:
            with Console(stderr=True).status(f"{times} times the bag"):
                table.rows.append(_row(arguments.bag, times, imus))
    show([table])
    if arguments.output is not None:
        with output_folder(arguments.output) as folder:
            (folder / "offline.md").write_text(document("Offline", [table]))
    return 0


@dataclass(frozen=True, kw_only=True)
class FuseCost:
    """What one run took."""

    duration_s: float  # of the bag
    cpu_s: float
    clock_s: float
    memory_mb: float  # at its peak


def fuse_cost(path: Path, times: int, imus: bool) -> FuseCost:
    """Fuse a bag that is repeated.

    Args:
        path: The bag.
        times: How often it is repeated.
        imus: Whether its IMUs stay in.

    Returns:
        What it took, start-up included.

    Raises:
        InputError: If the bag cannot be read or fused.
    """
    with tempfile.TemporaryDirectory(prefix="pose_bench_offline_") as name:
        folder = Path(name)
        with open_bag(path) as bag:
            duration_s = repeat(bag, folder / "in", times, imus=imus)
        begin = time.monotonic()
        cpu_s, memory_mb = _fused(folder / "in", folder / "out")
        clock_s = time.monotonic() - begin
    return FuseCost(duration_s=duration_s, cpu_s=cpu_s, clock_s=clock_s, memory_mb=memory_mb)


def _row(path: Path, times: int, imus: bool) -> list[str]:
    cost = fuse_cost(path, times, imus)
    sensors = "two Kinects, nine IMUs" if imus else "two Kinects"
    return [
        f"{sensors}, {number(cost.duration_s / 60.0, 1)} min",
        number(cost.cpu_s, 1),
        number(cost.duration_s / cost.cpu_s, 1),
        number(cost.duration_s / cost.clock_s, 1),
        number(cost.memory_mb, 0),
    ]


def _fused(in_bag: Path, out_bag: Path) -> tuple[float, float]:
    """CPU time [s] and peak memory [MB] of the tool."""
    words = [str(executable("pose_fusion", "fuse")), str(in_bag), str(out_bag)]
    # A process's peak counts what it was started from: so from a small one, not from this one.
    found = subprocess.run(
        [sys.executable, "-c", WATCH, *words], capture_output=True, text=True, check=False
    )
    if found.returncode != 0:
        raise InputError(f"fuse failed on {in_bag}: run ./pose fuse on the bag to see why")
    cpu_s, peak = map(float, found.stdout.split())
    return cpu_s, peak * 1024 / MB
