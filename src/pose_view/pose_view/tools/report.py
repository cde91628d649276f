"""``./pose report BAG``: tables and plots of a recording, on one page."""

import argparse
import sys
from functools import partial
from pathlib import Path

from rich.console import Console
from rich.progress import TimeRemainingColumn

from pose_core.api import Extrinsics
from pose_core.errors import InputError, writing
from pose_core.joints import JOINTS
from pose_fusion.session_extrinsics import checked_sensors, find_extrinsics
from pose_io.bags import BagReader, open_bag
from pose_io.references.reading import read_reference
from pose_node.command_line import add_option, add_path, run_tool
from pose_node.many import add_many_arguments, run_many
from pose_node.plain_console import progress_bar
from pose_view.report.analysis import Analysis, analyse
from pose_view.report.report_data import Wanted, read_report_data

PAGE = "report.html"


def make_parser() -> argparse.ArgumentParser:
    """The command line."""
    parser = argparse.ArgumentParser(
        prog="pose report",
        description="Measure a recorded bag and write one web page (report.html, opens without "
        "internet, prints well) and CSV files. Estimators are run over the bag's raw streams "
        "(--methods). With a reference, errors and correlations; without one, how well the methods "
        "agree.",
        epilog="References: docs/references.md says which files, labels and signs are understood.",
    )
    parser.add_argument(
        "bag",
        type=Path,
        help="a bag with kinect_<name>/skeletons, a recording, or a folder of either",
    )
    true = "what is true: a bag (the truth of a synthetic session), a Vicon .csv, .c3d, .trc, .mot"
    add_path(parser, "--reference", "BAG_OR_FILE", true)
    parser.add_argument(
        "-o", "--output", type=Path, metavar="DIR", help="folder to make (default: BAG-report)"
    )
    parser.add_argument(
        "--methods",
        nargs="+",
        default=[],
        metavar="NAME",
        help="what to compare: sensors, mean, fused (the bag's own result), estimators, with +imus "
        "where IMUs are to be used, for example: left mean joint_kf default default+imus; "
        "all: all of them (default: mean, joint_kf and the best there is)",
    )
    parser.add_argument(
        "--focus", default="", metavar="NAME", help="the method that single figures show"
    )
    shown = "whose x, y, z are shown"
    add_option(parser, "--joint", "right_knee", shown, "JOINT", choices=JOINTS)
    parser.add_argument(
        "--from",
        dest="from_s",
        type=float,
        default=0.0,
        metavar="S",
        help="start of the evaluated part, after the first frame [s]; what comes before is "
        "still filtered",
    )
    parser.add_argument(
        "--until", type=float, default=float("inf"), metavar="S", help="end of that part [s]"
    )
    whom = "first, nearest (to the first sensor), imus (who wears them), or a sensor's id"
    add_option(parser, "--person", "first", f"whom to report on: {whom}")
    parser.add_argument(
        "--body", default="", help="which fused body of the bag (default: the subject)"
    )
    parser.add_argument(
        "--extrinsics-file",
        default="",
        metavar="FILE",
        help="YAML of the calibration (default: the bag's, else found from its motion)",
    )
    add_many_arguments(parser)
    return parser


def write_report(analysis: Analysis, joint: str, folder: Path) -> list[Path]:
    """Write page and CSV files into a new folder; returns their paths.

    Raises:
        InputError: If it cannot be written.
    """
    from pose_view.report.csv_files import csv_files
    from pose_view.report.page.page import render_page

    files = {PAGE: render_page(analysis, joint), **csv_files(analysis)}
    with writing(folder):
        folder.mkdir(parents=True)
        for name, text in files.items():
            (folder / name).write_text(text, encoding="utf-8")
    return [folder / name for name in files]


def run() -> int | None:
    """The tool; returns the exit status."""
    options = make_parser().parse_args()
    status = run_many(options.bag, options.output, options)
    if status is not None:
        return status
    folder = options.output or options.bag.with_name(f"{options.bag.name}-report")
    if folder.exists():
        raise InputError(f"{folder} exists already: name another folder, or remove it first")
    console = Console(stderr=True)
    reference = None if options.reference is None else read_reference(options.reference)
    wanted = Wanted(
        name=_name(options.bag),
        methods=tuple(options.methods),
        focus=options.focus,
        person=options.person,
        body=options.body,
        from_s=options.from_s,
        until_s=options.until,
    )

    def placed(bag: BagReader, sensors: tuple[str, ...]) -> Extrinsics:
        sensors = checked_sensors(bag, (), options.extrinsics_file) if sensors else sensors
        say = partial(console.print, soft_wrap=True)
        return find_extrinsics(bag, sensors, say, options.extrinsics_file)

    with open_bag(options.bag) as bag, progress_bar(console, TimeRemainingColumn()) as progress:
        task = progress.add_task("reading", total=None)

        def show(share: float) -> None:
            progress.update(task, description="estimating", total=1.0, completed=share)

        recording = read_report_data(bag, wanted, placed, show)
    with console.status("measuring and drawing"):
        analysis = analyse(recording, reference)
        files = write_report(analysis, options.joint, folder)
    for note in recording.notes:
        print(f"note: {note}", file=sys.stderr)
    print(f"{files[0]}{' (synthetic subject)' if analysis.is_synthetic else ''}")
    print(f"{folder}: {', '.join(path.name for path in files[1:])}")
    return None


def _name(bag: Path) -> str:
    """Name of the recording; for a bag named ``bag``, its folder's name."""
    whole = bag.absolute()
    return f"{whole.parent.name}/{whole.name}" if whole.stem == "bag" else whole.name


def main() -> None:
    """Run the tool and exit."""
    run_tool(run)
