"""``./pose bench [WHAT]``: benchmarks; without a name, all of ``goals``.

Adding one means a module in this folder with ``add_arguments`` and ``run``, and a line in
:data:`BENCHMARKS`.
"""

import argparse
from collections.abc import Callable

from pose_bench.tools import (
    accuracy,
    captured,
    faults,
    fuzz,
    goals,
    imu,
    live,
    offline,
    papers,
    people,
    prediction,
    speed,
    stream,
    teleop,
)
from pose_node.command_line import run_tool

Benchmark = tuple[str, Callable[[argparse.ArgumentParser], None], Callable[..., int | None]]

BENCHMARKS: dict[str, Benchmark] = {
    "accuracy": (accuracy.SUMMARY, accuracy.add_arguments, accuracy.run),
    "captured": (captured.SUMMARY, captured.add_arguments, captured.run),
    "faults": (faults.SUMMARY, faults.add_arguments, faults.run),
    "fuzz": (fuzz.SUMMARY, fuzz.add_arguments, fuzz.run),
    "goals": (goals.SUMMARY, goals.add_arguments, goals.run),
    "imu": (imu.SUMMARY, imu.add_arguments, imu.run),
    "live": (live.SUMMARY, live.add_arguments, live.run),
    "offline": (offline.SUMMARY, offline.add_arguments, offline.run),
    "papers": (papers.SUMMARY, papers.add_arguments, papers.run),
    "people": (people.SUMMARY, people.add_arguments, people.run),
    "prediction": (prediction.SUMMARY, prediction.add_arguments, prediction.run),
    "speed": (speed.SUMMARY, speed.add_arguments, speed.run),
    "stream": (stream.SUMMARY, stream.add_arguments, stream.run),
    "teleop": (teleop.SUMMARY, teleop.add_arguments, teleop.run),
}
"""By name: one line of help, what adds the arguments, and what runs."""


def make_parser() -> argparse.ArgumentParser:
    """The command line."""
    parser = argparse.ArgumentParser(prog="pose bench", description="Benchmarks.")
    commands = parser.add_subparsers(dest="benchmark", metavar="WHAT")
    parser.set_defaults(benchmark="goals")
    goals.add_arguments(parser)
    for name, (summary, add_arguments, _) in BENCHMARKS.items():
        add_arguments(commands.add_parser(name, help=summary, description=summary))
    return parser


def run(arguments: list[str] | None = None) -> int | None:
    """The tool; returns the exit status."""
    parsed = make_parser().parse_args(arguments)
    return BENCHMARKS[parsed.benchmark][2](parsed)


def main() -> None:
    """Run the tool and exit."""
    run_tool(run)
