"""``./pose bench speed``: how long one update takes, against the same filter written plainly."""

import argparse

from rich.console import Console

from pose_bench.speed import (
    FRAMES,
    GROWTH_FRAMES,
    SLOW_FRAMES,
    TEXTBOOK,
    Timing,
    exponent,
    growth,
    machine,
    update_timings,
)
from pose_bench.tables import TextTable, number
from pose_bench.tools.showing import publish

SUMMARY = "how long one update takes, against plainly written filters, and how the cost grows"
QUICK_SHARE = 20  # one in so many repeats is run by --quick


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument("--quick", action="store_true", help="few repeats: to see that it works")


def run(arguments: argparse.Namespace) -> int:
    """Measure and print."""
    share = QUICK_SHARE if arguments.quick else 1
    with Console(stderr=True).status("measuring") as status:
        timings = []
        for timing in update_timings(FRAMES // share, max(SLOW_FRAMES // share, 8)):
            timings.append(timing)
            status.update(f"measured: {timing.name}")
        status.update("measuring how the cost grows")
        points = growth(max(GROWTH_FRAMES // share, 20))
    tables = [_update_table(timings), _growth_table(points)]
    publish(tables, "Speed", arguments.output, "speed.md")
    return 0


def _update_table(timings: list[Timing]) -> TextTable:
    textbook = next(timing for timing in timings if timing.name == TEXTBOOK).median_ms
    table = TextTable(
        title="One update, CPU time [ms]",
        header=["", "median", "99 %", "repeats", "faster than filterpy"],
        note=f"{machine()}. One thread; synthetic poses.",
    )
    for timing in timings:
        row = [timing.name, number(timing.median_ms, 3), number(timing.p99_ms, 3)]
        row += [str(len(timing.times_ms)), f"{number(textbook / timing.median_ms, 1)} times"]
        table.rows.append(row)
    return table


def _growth_table(points: dict[str, list[tuple[int, float]]]) -> TextTable:
    table = TextTable(
        title="Growth of the default estimator's filter: CPU time per second [ms]",
        header=["number of", "cost", "exponent"],
        note="Kinects at 30 Hz, all of an instant in one update, with nine IMUs; IMUs with two "
        "Kinects, each frame an update of its own; persons with two Kinects and nine IMUs each.",
    )
    for what, each in points.items():
        cost = ", ".join(f"{n}: {number(ms, 1)}" for n, ms in each)
        table.rows.append([what, cost, number(exponent(each), 2)])
    return table
