"""``./pose bench speed``: how long one update takes, against the same filter written plainly."""

import argparse

from rich.console import Console

from pose_bench import speed
from pose_bench.tools.showing import publish
from pose_evaluation.table import Table, number, table_of

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
        for timing in speed.update_timings(
            speed.FRAMES // share, max(speed.SLOW_FRAMES // share, 8)
        ):
            timings.append(timing)
            status.update(f"measured: {timing.name}")
        status.update("measuring how the cost grows")
        points = speed.growth(max(speed.GROWTH_FRAMES // share, 20))
    tables = [_update_table(timings), _growth_table(points)]
    publish(tables, "Speed", arguments.output, "speed.md")
    return 0


def _update_table(timings: list[speed.Timing]) -> Table:
    textbook = next(timing for timing in timings if timing.name == speed.TEXTBOOK).median_ms
    return table_of(
        "One update, CPU time [ms]",
        "",
        ((timing.name, timing) for timing in timings),
        {
            "median": lambda timing: number(timing.median_ms, 3),
            "99 %": lambda timing: number(timing.p99_ms, 3),
            "repeats": lambda timing: str(len(timing.times_ms)),
            "faster than filterpy": lambda timing: (
                f"{number(textbook / timing.median_ms, 1)} times"
            ),
        },
        f"{speed.machine()}. One thread; synthetic poses.",
    )


def _growth_table(points: dict[str, list[tuple[int, float]]]) -> Table:
    return table_of(
        "Growth of the default estimator's filter: CPU time per second [ms]",
        "number of",
        points.items(),
        {
            "cost": lambda each: ", ".join(f"{n}: {number(ms, 1)}" for n, ms in each),
            "exponent": lambda each: number(speed.exponent(each), 2),
        },
        "Kinects at 30 Hz, all of an instant in one update, with nine IMUs; IMUs with two "
        "Kinects, each frame an update of its own; persons with two Kinects and nine IMUs each.",
    )
