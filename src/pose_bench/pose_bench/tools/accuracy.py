"""``./pose bench accuracy``: estimators on public recordings of real people."""

import argparse
import sys
from collections.abc import Sequence
from itertools import chain
from typing import Any

from pose_bench import kinectmultitrack, uiprmd
from pose_bench.one_camera import RAW
from pose_bench.options import add_jobs_argument, add_list
from pose_bench.pool import run_all
from pose_bench.tools.showing import publish
from pose_core.errors import InputError
from pose_evaluation.table import Table
from pose_evaluation.tables import csv_text
from pose_node.command_line import add_path

SUMMARY = "how accurate the estimators are on public recordings of real people"
ESTIMATORS = ("joint_kf", "li2020", "default", "smoothed")
"""Estimators that are run on one camera, compared with its raw view."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    add_path(parser, "--uiprmd", "DIR", "with Kinect/ and Vicon/: one Kinect and Vicon")
    add_path(parser, "--kinectmultitrack", "DIR", "with *.csv[.gz]: two Kinects")
    add_list(parser, "--methods", ESTIMATORS, "estimators", "NAME", ESTIMATORS)
    add_jobs_argument(parser)


def run(arguments: argparse.Namespace) -> int:
    """Evaluate the recordings that were given."""
    if arguments.uiprmd is None and arguments.kinectmultitrack is None:
        raise InputError("no recordings: expected --uiprmd DIR, --kinectmultitrack DIR or both")
    tables: list[Table] = []
    files: dict[str, str] = {}
    if arguments.uiprmd is not None:
        used, left_out = uiprmd.read_repetitions(arguments.uiprmd)
        for reason, count in left_out.as_dict().items():
            if count:
                print(f"UI-PRMD: {count} repetitions left out, {reason}", file=sys.stderr)
        subjects = dict.fromkeys(repetition.subject for repetition in used)
        by_subject = [[r for r in used if r.subject == subject] for subject in subjects]
        calls = [(own, name) for name in (RAW, *arguments.methods) for own in by_subject]
        compared = run_all(uiprmd.compare_subject, calls, jobs=arguments.jobs, name="UI-PRMD")
        found = list(chain.from_iterable(compared))
        tables.append(uiprmd.table(found))
        files["accuracy_uiprmd.csv"] = rows_csv(found)
    if arguments.kinectmultitrack is not None:
        recordings = kinectmultitrack.single_person_recordings(arguments.kinectmultitrack)
        pairs = [(each, fed, tuple(arguments.methods)) for each in recordings for fed in (0, 1)]
        name = "KinectMultiTrack"
        seen = run_all(kinectmultitrack.compare_views, pairs, jobs=arguments.jobs, name=name)
        views = list(chain.from_iterable(seen))
        tables.append(kinectmultitrack.table(views))
        files["accuracy_kinectmultitrack.csv"] = rows_csv(views)
    publish(tables, "Accuracy", arguments.output, "accuracy.md", **files)
    if arguments.output is not None:
        print(f"{arguments.output}: {', '.join((*files, 'accuracy.md'))}")
    return 0


def rows_csv(rows: Sequence[Any]) -> str:
    """Dataclass values of one kind as CSV, one row each; real people."""
    names = vars(rows[0]) if rows else ()
    return csv_text(("subject_kind", *names), (("real", *vars(row).values()) for row in rows))
