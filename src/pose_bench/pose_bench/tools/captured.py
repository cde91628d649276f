"""``./pose bench captured``: every method on captured people before simulated sensors."""

import argparse
import csv
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from pose_bench.captured import BASELINE, METHODS, CapturedScore, captured_specs, run_suite
from pose_bench.tables import TextTable, number
from pose_bench.tools.showing import document, output_folder, show

SUMMARY = "how accurate the estimators are on captured people before simulated sensors"
SEED = 101


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument(
        "--motion",
        type=Path,
        action="append",
        metavar="DIR",
        help="folder of clips, see pose_sim; may be given again (default: the bundled ones)",
    )
    parser.add_argument(
        "--tuning",
        action="store_true",
        help="the trackers that tuning may look at, instead of those that it has not seen",
    )
    parser.add_argument(
        "--methods",
        nargs="+",
        choices=[method.name for method in METHODS],
        default=[method.name for method in METHODS],
        help="beside the baseline (default: all)",
    )
    parser.add_argument("--seed", type=int, default=SEED, help="of everything random")
    parser.add_argument("-o", "--output", type=Path, metavar="DIR", help="folder for the tables")


def run(arguments: argparse.Namespace) -> int:
    """Run the suite; prints the means, with the worst session beside them."""
    folders: Sequence[Path | None] = arguments.motion or [None]
    specs = [
        spec
        for each in folders
        for spec in captured_specs(each, judged=not arguments.tuning, seed=arguments.seed)
    ]
    methods = [each for each in METHODS if each.name in (*arguments.methods, BASELINE)]
    columns = (TextColumn("{task.description}"), BarColumn(), TimeRemainingColumn())
    scores: list[CapturedScore] = []
    with Progress(*columns, console=Console(stderr=True)) as progress:
        for each in progress.track(
            run_suite(specs, methods), total=len(specs), description="sessions"
        ):
            scores += each
    table = summary_table(scores, len(specs))
    show([table])
    if arguments.output is not None:
        with output_folder(arguments.output) as folder:
            (folder / "captured.md").write_text(document(SUMMARY, [table]))
            write_csv(folder / "captured.csv", scores)
    return 0


def write_csv(path: Path, scores: Sequence[CapturedScore]) -> None:
    """Every session's scores, four digits of each."""
    with path.open("w", newline="") as file:
        writer = csv.DictWriter(file, list(asdict(scores[0])))
        writer.writeheader()
        for score in scores:
            row = asdict(score).items()
            writer.writerow({k: f"{v:.4g}" if isinstance(v, float) else v for k, v in row})


def summary_table(scores: Sequence[CapturedScore], sessions: int) -> TextTable:
    """A row for each method."""
    rows: list[Sequence[str]] = []
    for method in METHODS:
        own = [score for score in scores if score.method == method.name]
        if not own:
            continue
        mean = {
            name: float(np.nanmean([getattr(score, name) for score in own]))
            for name in CapturedScore.__dataclass_fields__
            if name not in ("session", "method")
        }
        rows.append(
            (
                method.name,
                number(mean["rmse_ratio"], 2),
                number(max(score.rmse_ratio for score in own), 2),
                number(mean["rmse_deg"], 1),
                number(mean["hip_knee_deg"], 1),
                number(mean["r"], 2),
                number(mean["mpjpe_mm"], 0),
                number(mean["mpjpe_ratio"], 2),
                number(mean["lag_ms"], 0),
                number(mean["jerk"], 0),
            )
        )
    return TextTable(
        title="Captured people, simulated sensors",
        header=(
            "method",
            "RMSE / joint_kf",
            "worst session",
            "RMSE [deg]",
            "hips, knees [deg]",
            "r",
            "MPJPE [mm]",
            "MPJPE / joint_kf",
            "lag [ms]",
            "jerk [m/s³]",
        ),
        rows=rows,
        note=f"{sessions} sessions; ratios: mean over sessions to joint_kf on the same samples",
    )
