"""``./pose bench accuracy``: every estimator on every motion, and on public recordings."""

import argparse
import os
from pathlib import Path

from rich.console import Console
from rich.progress import MofNCompleteColumn, TimeRemainingColumn

from pose_bench import kinectmultitrack, uiprmd
from pose_bench.accuracy import (
    ESTIMATORS,
    rows_csv,
    run_kinectmultitrack,
    run_suite,
    run_uiprmd,
    scores_csv,
)
from pose_bench.methods import METHODS, Method, available_methods
from pose_bench.pool import Progress
from pose_bench.suite import CALIBRATION_WALK, JUDGING_SEEDS, LEVELS, cells, quick_cells
from pose_bench.summary import failures, tables
from pose_bench.tables import TextTable
from pose_bench.tools.showing import document, output_folder, show
from pose_core.errors import InputError
from pose_node.plain_console import progress_bar
from pose_sim.choreography import CHOREOGRAPHIES
from pose_sim.session import NOISE_PRESETS

SUMMARY = "how accurate the estimators are, on the synthetic subject and on public recordings"
REAL_DATA = {"uiprmd": "UI-PRMD", "kinectmultitrack": "KinectMultiTrack"}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    _add_session_arguments(parser.add_argument_group("which sessions"))
    real = parser.add_argument_group("public recordings, left out unless their folder is given")
    real.add_argument(
        "--uiprmd", type=Path, metavar="DIR", help="with Kinect/ and Vicon/: one Kinect and Vicon"
    )
    real.add_argument(
        "--kinectmultitrack", type=Path, metavar="DIR", help="with *.csv[.gz]: two Kinects"
    )
    real.add_argument("--only-real", action="store_true", help="leave the synthetic subject out")
    names = ", ".join(method.name for method in METHODS)
    parser.add_argument(
        "--methods",
        nargs="+",
        choices=[method.name for method in METHODS],
        metavar="NAME",
        help=f"of {names} (default: all)",
    )
    parser.add_argument(
        "--jobs",
        type=int,
        default=os.cpu_count() or 1,
        metavar="N",
        help="processes at once (default: %(default)s)",
    )
    parser.add_argument(
        "-o", "--output", type=Path, metavar="DIR", help="folder for accuracy.md and the CSV files"
    )


def _add_session_arguments(group: argparse._ArgumentGroup) -> None:
    group.add_argument(
        "--choreographies",
        nargs="+",
        metavar="NAME",
        default=[],
        help=f"of {', '.join(CHOREOGRAPHIES)} (default: all but {CALIBRATION_WALK})",
    )
    group.add_argument(
        "--levels",
        nargs="+",
        choices=NOISE_PRESETS,
        default=list(LEVELS),
        metavar="NAME",
        help=f"of {', '.join(NOISE_PRESETS)} (default: {' '.join(LEVELS)})",
    )
    group.add_argument(
        "--seeds",
        nargs="+",
        type=int,
        metavar="N",
        default=list(JUDGING_SEEDS),
        help=f"seeds (default: {' '.join(map(str, JUDGING_SEEDS))}, which nothing is tuned on)",
    )
    group.add_argument("--quick", action="store_true", help="three short sessions instead")


def run(arguments: argparse.Namespace) -> int:
    """Run the suite; the status is 1 if a method failed anywhere."""
    if arguments.jobs < 1:
        raise InputError(f"jobs = {arguments.jobs}: expected 1 or more")
    if any(seed < 0 for seed in arguments.seeds):
        raise InputError(f"seeds = {arguments.seeds}: none may be negative")
    return _Bench(arguments, Console(stderr=True)).run()


class _Bench:
    """One run: what it found so far."""

    def __init__(self, arguments: argparse.Namespace, console: Console) -> None:
        self._arguments = arguments
        self._console = console
        self._tables: list[TextTable] = []
        self._files: dict[str, str] = {}
        self._failures: list[str] = []
        self._methods = self._available()

    def run(self) -> int:
        columns = (MofNCompleteColumn(), TimeRemainingColumn())
        with progress_bar(self._console, *columns) as self._progress:
            if not self._arguments.only_real:
                self._run_synthetic()
            self._run_real()
        if self._arguments.output is not None:
            self._write(self._arguments.output)
        show(self._tables)
        if self._arguments.output is not None:
            print(f"{self._arguments.output}: {', '.join(self._files)}")
        for line in self._failures:
            self._console.print(f"failed: {line}", style="red", markup=False, soft_wrap=True)
        return 1 if self._failures else 0

    def _available(self) -> tuple[Method, ...]:
        names = self._arguments.methods
        wanted = [method for method in METHODS if names is None or method.name in names]
        there = available_methods()
        for method in wanted:
            if method not in there:
                self._say(f"left out: {method.name}, there is no estimator {method.estimator}")
        return tuple(method for method in wanted if method in there)

    def _run_synthetic(self) -> None:
        arguments = self._arguments
        chosen = (
            quick_cells()
            if arguments.quick
            else cells(arguments.choreographies, arguments.levels, arguments.seeds)
        )
        scores = run_suite(
            chosen,
            self._methods,
            jobs=arguments.jobs,
            progress=self._bar("sessions"),
        )
        self._tables += tables(scores)
        self._files["accuracy.csv"] = scores_csv(scores)
        self._failures += failures(scores)

    def _run_real(self) -> None:
        arguments = self._arguments
        for option, name in REAL_DATA.items():
            if getattr(arguments, option) is None:
                self._say(f"left out: {name}, no --{option} DIR was given")
        there = {method.name for method in self._methods}
        estimators = [name for name in ESTIMATORS if name in there]
        if arguments.uiprmd is not None:
            found, left_out = run_uiprmd(
                arguments.uiprmd,
                estimators,
                jobs=arguments.jobs,
                progress=self._bar("UI-PRMD"),
            )
            for reason, count in left_out.items():
                if count:
                    self._say(f"UI-PRMD: {count} repetitions left out, {reason}")
            self._tables.append(uiprmd.table(found))
            self._files["accuracy_uiprmd.csv"] = rows_csv(found)
        if arguments.kinectmultitrack is not None:
            views = run_kinectmultitrack(
                arguments.kinectmultitrack,
                estimators,
                jobs=arguments.jobs,
                progress=self._bar("KinectMultiTrack"),
            )
            self._tables.append(kinectmultitrack.table(views))
            self._files["accuracy_kinectmultitrack.csv"] = rows_csv(views)

    def _bar(self, what: str) -> Progress:
        task = self._progress.add_task(what, total=None)

        def update(done: int, total: int) -> None:
            self._progress.update(task, completed=done, total=total)

        return update

    def _say(self, text: str) -> None:
        self._console.print(text, markup=False, soft_wrap=True)

    def _write(self, folder: Path) -> None:
        self._files["accuracy.md"] = document("Accuracy", self._tables)
        with output_folder(folder):
            for name, text in self._files.items():
                (folder / name).write_text(text)
