"""``./pose bench imu [BROAD_DIR]``: every orientation filter, on BROAD and on the synthetic set."""

import argparse
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import Progress, TimeRemainingColumn

from pose_bench.imu_accuracy import KINDS, VARIANTS, read_broad, synthetic_errors, trial_errors
from pose_bench.tools.showing import publish
from pose_core.arrays import FloatArray
from pose_core.errors import InputError
from pose_evaluation.table import Table, number_row
from pose_node.plain_console import progress_bar

SUMMARY = "how accurate the IMUs' orientation filters are, on BROAD and on the synthetic subject"
PUBLISHED = (
    "Published, in the results file of github.com/dlaidig/broad: Madgwick at its best common gain "
    "(0.12), mean of all 39 trials: total 4.96, heading 3.92, inclination 2.71; trial 03 alone "
    "2.47, 2.29, 0.93; trial 07 alone 5.00, 4.33, 2.50."
)
SYNTHETIC = (
    ("leg_lift_march", "typical"),
    ("dance", "typical"),
    ("kicks", "typical"),
    ("dance", "hard"),
)
SYNTHETIC_NOTE = (
    "Nothing of it comes from a person. RMS over nine nodes, stamps and radio included. The "
    "magnetic field is disturbed at each node by 3 uT (typical) or 7.5 uT (hard) per axis, and "
    "by a slow change."
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument(
        "broad",
        nargs="?",
        type=Path,
        metavar="BROAD_DIR",
        help="folder of BROAD's .mat files; without it only the synthetic set is run",
    )
    parser.add_argument("--no-synthetic", action="store_true", help="leave the synthetic set out")


def run(arguments: argparse.Namespace) -> int:
    """Run the filters and print the tables."""
    if arguments.no_synthetic and arguments.broad is None:
        raise InputError("nothing to run: give BROAD_DIR, or leave out --no-synthetic")
    with progress_bar(Console(stderr=True), TimeRemainingColumn()) as progress:
        tables: list[Table] = []
        if arguments.broad is not None:
            tables += _broad(arguments.broad, progress)
        if not arguments.no_synthetic:
            tables += _synthetic(progress)
    publish(tables, "Orientation filters", arguments.output, "imu_accuracy.md")
    return 0


def _broad(folder: Path, progress: Progress) -> list[Table]:
    trials = read_broad(folder)
    found = [
        trial_errors(trials, each, partial(progress.track, description=f"BROAD, {each.name}"))
        for each in VARIANTS
    ]
    rows = dict(zip((trial.name for trial in trials), zip(*found, strict=True), strict=True))
    return _tables("BROAD (optical truth)", rows, PUBLISHED)


def _synthetic(progress: Progress) -> list[Table]:
    task = progress.add_task("synthetic", total=len(SYNTHETIC) * len(VARIANTS))
    rows: dict[str, Sequence[FloatArray]] = {}
    for choreography, level in SYNTHETIC:
        row = []
        for variant in VARIANTS:
            row.append(synthetic_errors(choreography, level, variant))
            progress.advance(task)
        rows[f"{choreography}, {level}"] = row
    return _tables("Synthetic subject", rows, SYNTHETIC_NOTE)


def _tables(title: str, rows: Mapping[str, Sequence[FloatArray]], note: str) -> list[Table]:
    """One table a kind of error; the note under the last."""
    if len(rows) > 1:
        rows = {**rows, "mean": list(np.mean(list(rows.values()), axis=0))}
    return [
        Table(
            caption=f"{title}: {kind} RMS error [deg]",
            head="",
            columns=[variant.name for variant in VARIANTS],
            rows=[number_row(name, [each[k] for each in found], 2) for name, found in rows.items()],
            note=note if kind == KINDS[-1] else "",
        )
        for k, kind in enumerate(KINDS)
    ]
