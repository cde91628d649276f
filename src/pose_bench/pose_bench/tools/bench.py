"""``./pose bench [WHAT]``: benchmarks; without a name, all of ``goals``.

Adding one means a module in this folder with ``add_arguments`` and ``run``, and its name in
:data:`BENCHMARKS`.
"""

import argparse
from importlib import import_module
from pathlib import Path

from pose_node.command_line import run_tool

BENCHMARKS = {
    name: import_module(f"pose_bench.tools.{name}")
    for name in (
        *("accuracy", "captured", "faults", "fuzz", "goals", "imu", "live", "load", "noise"),
        *("offline", "papers", "people", "prediction", "soak", "speed", "steps", "stream"),
        "teleop",
    )
}
"""By name; each has a ``SUMMARY``, ``add_arguments`` and ``run``."""
ONLY_PRINT = ("goals", "steps")
"""Those that write no files."""


def make_parser() -> argparse.ArgumentParser:
    """The command line."""
    parser = argparse.ArgumentParser(prog="pose bench", description="Benchmarks.")
    commands = parser.add_subparsers(dest="benchmark", metavar="WHAT")
    parser.set_defaults(benchmark="goals")
    BENCHMARKS["goals"].add_arguments(parser)
    for name, module in BENCHMARKS.items():
        command = commands.add_parser(name, help=module.SUMMARY, description=module.SUMMARY)
        module.add_arguments(command)
        if name not in ONLY_PRINT:
            command.add_argument(
                "-o", "--output", type=Path, metavar="DIR", help="folder for the results"
            )
    return parser


def run(arguments: list[str] | None = None) -> int | None:
    """The tool; returns the exit status."""
    parsed = make_parser().parse_args(arguments)
    return BENCHMARKS[parsed.benchmark].run(parsed)


def main() -> None:
    """Run the tool and exit."""
    run_tool(run)
