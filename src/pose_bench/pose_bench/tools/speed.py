"""``./pose bench speed``: how long one update takes, against the same filter written plainly."""

import argparse
from pathlib import Path

import matplotlib
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
from pose_bench.tools.showing import document, output_folder, show

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
    show(tables)
    if arguments.output is not None:
        with output_folder(arguments.output) as folder:
            (folder / "speed.md").write_text(document("Speed", tables))
            _plot(points, folder / "speed_growth.png")
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


def _plot(points: dict[str, list[tuple[int, float]]], path: Path) -> None:
    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(1, len(points), figsize=(12.0, 3.5), layout="constrained")
    for axis, (what, each) in zip(axes, points.items(), strict=True):
        axis.plot(*zip(*each, strict=True), "o-", color="#0072b2")
        axis.set_xlabel(f"number of {what}")
        axis.set_ylabel("CPU time per second of data [ms]")
        axis.set_ylim(bottom=0.0)
        axis.xaxis.get_major_locator().set_params(integer=True)
        axis.set_title(f"exponent {exponent(each):.2f}")
        axis.grid(alpha=0.3)
    figure.savefig(path, dpi=110)
    plt.close(figure)
