"""``./pose bench accuracy``: every estimator on every motion of the synthetic subject."""

import argparse
import os
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from pose_bench.accuracy import run_suite
from pose_bench.methods import METHODS, Method, available_methods
from pose_bench.scores_csv import to_csv
from pose_bench.scoring import Score
from pose_bench.suite import JUDGING_SEEDS, LEVELS, Cell, cells, quick_cells
from pose_bench.summary import failures, tables
from pose_common.errors import InputError
from pose_sim.choreography import CHOREOGRAPHIES
from pose_sim.session import NOISE_PRESETS

SUMMARY = "how accurate the estimators are, on the synthetic subject"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    suite = parser.add_argument_group("which sessions")
    suite.add_argument(
        "--choreographies",
        nargs="+",
        metavar="NAME",
        default=[],
        help=f"of {', '.join(CHOREOGRAPHIES)} (default: all)",
    )
    suite.add_argument(
        "--levels",
        nargs="+",
        choices=NOISE_PRESETS,
        default=list(LEVELS),
        help=f"levels of difficulty (default: {' '.join(LEVELS)})",
    )
    suite.add_argument(
        "--seeds",
        nargs="+",
        type=int,
        metavar="N",
        default=list(JUDGING_SEEDS),
        help=f"seeds (default: {' '.join(map(str, JUDGING_SEEDS))}, which nothing is tuned on)",
    )
    suite.add_argument("--quick", action="store_true", help="three short sessions instead")
    parser.add_argument(
        "--methods",
        nargs="+",
        choices=[method.name for method in METHODS],
        metavar="NAME",
        help=f"of {', '.join(method.name for method in METHODS)} (default: all)",
    )
    parser.add_argument(
        "--jobs",
        type=int,
        default=os.cpu_count() or 1,
        metavar="N",
        help="processes at once (default: %(default)s)",
    )
    parser.add_argument(
        "-o",
        "--output",
        type=Path,
        metavar="DIR",
        help="folder for accuracy.csv and accuracy.md",
    )
    parser.add_argument(
        "--cache",
        type=Path,
        metavar="DIR",
        default=default_cache(),
        help="folder that keeps the IMUs' orientations for the next run (default: %(default)s)",
    )


def default_cache() -> Path:
    """The user's folder for what can be made again."""
    base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base) / "pose_fusion" / "bench"


def run(arguments: argparse.Namespace) -> int:
    """Run the suite; the status is 1 if a method failed anywhere."""
    console = Console(stderr=True)
    if arguments.jobs < 1:
        raise InputError(f"jobs = {arguments.jobs}: expected 1 or more")
    methods = _methods(arguments.methods, console)
    chosen = (
        quick_cells()
        if arguments.quick
        else cells(arguments.choreographies, arguments.levels, arguments.seeds)
    )
    scores = _run(chosen, methods, arguments, console)
    _show(scores, arguments.output)
    failed = failures(scores)
    for line in failed:
        console.print(f"failed: {line}", style="red", markup=False, soft_wrap=True)
    return 1 if failed else 0


def _methods(names: Sequence[str] | None, console: Console) -> tuple[Method, ...]:
    wanted = [method for method in METHODS if names is None or method.name in names]
    there = available_methods()
    for method in wanted:
        if method not in there:
            console.print(f"left out: {method.name}, there is no estimator {method.estimator}")
    return tuple(method for method in wanted if method in there)


def _run(
    chosen: Sequence[Cell],
    methods: Sequence[Method],
    arguments: argparse.Namespace,
    console: Console,
) -> list[Score]:
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=console) as progress:
        task = progress.add_task("sessions", total=len(chosen))
        return run_suite(
            chosen,
            methods,
            cache=arguments.cache,
            jobs=arguments.jobs,
            done=lambda _: progress.advance(task),
        )


def _show(scores: Sequence[Score], folder: Path | None) -> None:
    console = Console()
    made = tables(scores)
    for table in made:
        console.print(table.rich())
        console.print()
    if folder is None:
        return
    try:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "accuracy.csv").write_text(to_csv(scores))
        (folder / "accuracy.md").write_text("\n".join(table.markdown() for table in made))
    except OSError as error:
        raise InputError(f"cannot write {folder}: {error.strerror}") from error
    console.print(f"{folder}: accuracy.csv, accuracy.md", markup=False)
