"""``./pose bench offline BAG``: how fast ``fuse`` is, and how much memory it takes."""

import argparse
import resource
import subprocess
import tempfile
import time
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console

from pose_bench.options import add_list
from pose_bench.processes import usages
from pose_bench.repeated_messages import shifted_by
from pose_bench.speed import machine
from pose_bench.tools.showing import publish
from pose_core.errors import InputError
from pose_core.stamps import NS_PER_S
from pose_evaluation.table import number, table_of
from pose_io.bag_writer import BagWriter
from pose_io.bags import BagReader, open_bag
from pose_io.names import TF_STATIC
from pose_io.topics import imu_topics, sensor_topics
from pose_node.child_process import executable

PAUSE_NS = 33_333_333  # [ns] between the end and the next beginning
SUMMARY = "how fast ./pose fuse is on bags of several lengths, and how much memory it takes"
LOOK_S = 0.2  # [s] between measurements of the memory


def repeat(bag: BagReader, path: Path, times: int, *, imus: bool = True) -> float:
    """Write a bag of the sensors' messages, repeated, and the static transforms.

    Returns its duration [s].

    Args:
        bag: A bag of at most some minutes: its messages are kept in memory.
        path: The bag to create.
        times: Number of repetitions.
        imus: Whether to include the IMUs.
    """
    topics = [*sensor_topics(bag).values(), *(imu_topics(bag).values() if imus else ())]
    messages = list(bag.messages(topics))
    first_ns = messages[0].stamp_ns
    period_ns = messages[-1].stamp_ns - first_ns + PAUSE_NS
    with BagWriter(path) as writer:
        writer.add_topic(TF_STATIC, "tf2_msgs/msg/TFMessage", latched=True)
        for message in list(bag.messages([TF_STATIC]))[-1:]:
            writer.write_serialized(message.topic, message.msgtype, message.data, first_ns)
        for turn in range(times):
            shift_ns = turn * period_ns
            for message in messages:
                data = shifted_by(message.data, shift_ns)
                writer.write_serialized(
                    message.topic, message.msgtype, data, message.stamp_ns + shift_ns
                )
    return times * period_ns / NS_PER_S


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument("bag", type=Path, help="of some ten seconds, as ./pose demo leaves one")
    add_list(
        parser, "--times", [1, 10], "how often it is repeated, for each of the bags to make", "N"
    )


def run(arguments: argparse.Namespace) -> int:
    """Measure and print."""
    costs: list[tuple[str, FuseCost]] = []
    for imus in (False, True):
        sensors = "two Kinects, nine IMUs" if imus else "two Kinects"
        for times in arguments.times:
            with Console(stderr=True).status(f"{times} times the bag"):
                cost = fuse_cost(arguments.bag, times, imus)
            costs.append((f"{sensors}, {number(cost.duration_s / 60.0, 1)} min", cost))
    table = table_of(
        "./pose fuse, start-up included",
        "",
        costs,
        {
            "time [s]": lambda cost: number(cost.clock_s, 1),
            "times real time": lambda cost: number(cost.duration_s / cost.clock_s, 1),
            "CPU time [s]": lambda cost: number(cost.cpu_s, 1),
            "peak memory [MB]": lambda cost: number(cost.memory_mb, 0),
        },
        f"{machine()}. The bag repeated, its IMUs left out or not. Time by the clock; CPU "
        "time and memory of the process and its children.",
    )
    publish([table], "Offline", arguments.output, "offline.md")
    return 0


@dataclass(frozen=True, kw_only=True)
class FuseCost:
    """Cost of one run."""

    duration_s: float  # of the bag
    clock_s: float
    cpu_s: float  # of all its processes
    memory_mb: float  # of all its processes, at their peak


def fuse_cost(path: Path, times: int, imus: bool) -> FuseCost:
    """Fuse a bag that is repeated.

    Args:
        path: The bag.
        times: Number of repetitions.
        imus: Whether to include the IMUs.

    Returns:
        The cost, including start-up.

    Raises:
        InputError: If the bag cannot be read or fused.
    """
    with tempfile.TemporaryDirectory(prefix="pose_bench_offline_") as name:
        folder = Path(name)
        with open_bag(path) as bag:
            duration_s = repeat(bag, folder / "in", times, imus=imus)
        clock_s, cpu_s, memory_mb = _fused(folder / "in", folder / "out")
    return FuseCost(duration_s=duration_s, clock_s=clock_s, cpu_s=cpu_s, memory_mb=memory_mb)


def _fused(in_bag: Path, out_bag: Path) -> tuple[float, float, float]:
    """Time by the clock [s], CPU time [s] and peak memory [MB] of the tool and its children."""
    words = [str(executable("pose_fusion", "fuse")), str(in_bag), str(out_bag)]
    before, begin = _cpu_of_children_s(), time.monotonic()
    memory_mb = 0.0
    process = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    with process:
        while True:
            # Shared memory is counted once.
            memory_mb = max(memory_mb, sum(usages(process.pid).memory_mb.values()))
            with suppress(subprocess.TimeoutExpired):
                process.wait(LOOK_S)
                break
    clock_s = time.monotonic() - begin
    if process.returncode != 0:
        raise InputError(f"fuse failed on {in_bag}: run ./pose fuse on the bag to see why")
    return clock_s, _cpu_of_children_s() - before, memory_mb


def _cpu_of_children_s() -> float:
    """CPU time of all children that have ended, and of theirs [s]."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime
