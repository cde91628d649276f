"""``./pose bench accuracy``: estimators on public recordings of real people."""

import argparse
from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import MofNCompleteColumn, Progress, TimeRemainingColumn

from pose_bench import kinectmultitrack, uiprmd
from pose_bench.kinectmultitrack import OtherView
from pose_bench.one_camera import RAW
from pose_bench.pool import add_jobs_argument, run_all
from pose_bench.tables import TextTable
from pose_bench.tools.showing import publish
from pose_bench.uiprmd import AngleAgreement
from pose_core.errors import InputError
from pose_evaluation.tables import csv_text
from pose_node.plain_console import progress_bar

SUMMARY = "how accurate the estimators are on public recordings of real people"
ESTIMATORS = ("joint_kf", "li2020", "default")
"""Estimators that are run on one camera, compared with its raw view."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument(
        "--uiprmd", type=Path, metavar="DIR", help="with Kinect/ and Vicon/: one Kinect and Vicon"
    )
    parser.add_argument(
        "--kinectmultitrack", type=Path, metavar="DIR", help="with *.csv[.gz]: two Kinects"
    )
    parser.add_argument(
        "--methods",
        nargs="+",
        choices=ESTIMATORS,
        default=ESTIMATORS,
        metavar="NAME",
        help=f"of {', '.join(ESTIMATORS)} (default: all)",
    )
    add_jobs_argument(parser)


def run(arguments: argparse.Namespace) -> int:
    """Evaluate the recordings that were given."""
    if arguments.uiprmd is None and arguments.kinectmultitrack is None:
        raise InputError("no recordings: expected --uiprmd DIR, --kinectmultitrack DIR or both")
    tables: list[TextTable] = []
    files: dict[str, str] = {}
    console = Console(stderr=True)
    with progress_bar(console, MofNCompleteColumn(), TimeRemainingColumn()) as bar:
        options = {"estimators": arguments.methods, "jobs": arguments.jobs, "bar": bar}
        if arguments.uiprmd is not None:
            found, left_out = run_uiprmd(arguments.uiprmd, **options)
            for reason, count in left_out.items():
                if count:
                    text = f"UI-PRMD: {count} repetitions left out, {reason}"
                    console.print(text, markup=False, soft_wrap=True)
            tables.append(uiprmd.table(found))
            files["accuracy_uiprmd.csv"] = rows_csv(found)
        if arguments.kinectmultitrack is not None:
            views = run_kinectmultitrack(arguments.kinectmultitrack, **options)
            tables.append(kinectmultitrack.table(views))
            files["accuracy_kinectmultitrack.csv"] = rows_csv(views)
    publish(tables, "Accuracy", arguments.output, "accuracy.md", **files)
    if arguments.output is not None:
        print(f"{arguments.output}: {', '.join((*files, 'accuracy.md'))}")
    return 0


def rows_csv(rows: Sequence[Any]) -> str:
    """Dataclass values of one kind as CSV, one row each; real people."""
    names = [each.name for each in fields(rows[0])] if rows else []
    values = (("real", *(getattr(row, name) for name in names)) for row in rows)
    return csv_text(("subject_kind", *names), values)


def run_uiprmd(
    folder: Path, estimators: Sequence[str], *, jobs: int, bar: Progress
) -> tuple[list[AngleAgreement], dict[str, int]]:
    """Evaluate every repetition, raw and by each estimator; and count those left out, by reason.

    Raises:
        InputError: If the folder holds no usable repetition, or one is damaged.
    """
    repetitions = uiprmd.read_repetitions(folder)
    subjects = dict.fromkeys(repetition.subject for repetition in repetitions.used)
    by_subject = [[r for r in repetitions.used if r.subject == subject] for subject in subjects]
    arguments = [(own, name) for name in (RAW, *estimators) for own in by_subject]
    found = run_all(uiprmd.compare_subject, arguments, jobs=jobs, bar=bar, name="UI-PRMD")
    return [each for agreements in found for each in agreements], repetitions.left_out.as_dict()


def run_kinectmultitrack(
    folder: Path, estimators: Sequence[str], *, jobs: int, bar: Progress
) -> list[OtherView]:
    """Evaluate recordings of one person: each camera's raw view and estimates against the other's.

    Raises:
        InputError: If the folder holds no usable recording, or one is damaged.
    """
    recordings = kinectmultitrack.single_person_recordings(folder)
    arguments = [(recording, fed, tuple(estimators)) for recording in recordings for fed in (0, 1)]
    compare, name = kinectmultitrack.compare_views, "KinectMultiTrack"
    found = run_all(compare, arguments, jobs=jobs, bar=bar, name=name)
    return [view for views in found for view in views]
