"""``./pose calibrate IN_BAG -o extrinsics.yaml``: extrinsics of a session's sensors.

``./pose calibrate board`` uses images of a board, ``./pose calibrate live`` the running sensors;
``./pose calibrate imu`` estimates the sensor-to-segment alignment of IMUs.
"""

import argparse
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import TimeRemainingColumn
from rich.table import Table

from pose_calibration.extrinsics.parameters import CalibrationParameters
from pose_calibration.files.extrinsics_file import save_extrinsics
from pose_calibration.inertial.imu_clock import ImuFindings
from pose_calibration.session_calibration import SessionCalibration, calibrate_people
from pose_core.api import IMUS, PairResiduals
from pose_core.errors import InputError
from pose_core.joints import JOINTS
from pose_core.parameters import add_arguments, from_arguments
from pose_fusion.calibration_lines import floor_line, single_imu_lines, tracker_lines
from pose_fusion.session_extrinsics import checked_sensors
from pose_io.bag_samples import BagFrames
from pose_io.bags import BagReader, open_bag
from pose_io.renamed_topics import add_remap_argument
from pose_node.command_line import add_output, check_folder_of
from pose_node.plain_console import add_share, progress_bar


def make_parser() -> argparse.ArgumentParser:
    """The command line."""
    parser = argparse.ArgumentParser(prog="pose calibrate", description=__doc__)
    parser.add_argument("in_bag", type=Path, help="a bag with kinect_<name>/skeletons")
    add_output(parser, "the YAML to write; replaced if it exists")
    parser.add_argument(
        "--sensors", nargs="+", metavar="NAME", help="the reference first (default: all, by name)"
    )
    add_remap_argument(parser)
    add_arguments(parser.add_argument_group("parameters"), CalibrationParameters)
    return parser


def choose_sensors(bag: BagReader, wanted: Sequence[str] | None) -> tuple[str, ...]:
    """The sensors to calibrate, checked against the bag.

    Raises:
        InputError: If the bag has fewer than two of them.
    """
    sensors = checked_sensors(bag, wanted or ())
    if len(set(sensors)) < 2:
        raise InputError(
            f"{bag.path}: one sensor alone ({', '.join(set(sensors))}) has nothing to be "
            "calibrated against: give a bag with two or more"
        )
    if len(set(sensors)) < len(sensors):
        raise InputError(f"--sensors {' '.join(sensors)}: expected different names")
    return sensors


def calibrate_bag(
    bag: BagReader, sensors: Sequence[str], parameters: CalibrationParameters
) -> SessionCalibration:
    """Calibrate the session that a bag holds.

    Raises:
        CalibrationError: If it does not determine the calibration.
        InputError: If the bag is damaged.
    """
    with progress_bar(Console(stderr=True), TimeRemainingColumn()) as progress:
        frames = BagFrames(bag, add_share(progress, "reading"))
        everything = list(frames)
        for line in frames.left_out:
            progress.console.print(line, soft_wrap=True)
        progress.add_task("solving", total=None)
        return calibrate_people(everything, sensors, parameters)


def agreement_table(session: SessionCalibration) -> Table:
    """Agreement of each sensor with the reference, before and after, and by joint."""
    residuals = session.extrinsics.residuals
    table = Table(title=f"agreement with '{session.extrinsics.reference}'", show_edge=False)
    table.add_column("")
    for name in residuals:
        table.add_column(name, justify="right")

    def add_row(label: str, value: Callable[[PairResiduals], str], last: bool = False) -> None:
        table.add_row(label, *(value(pair) for pair in residuals.values()), end_section=last)

    add_row("frames seen by both", lambda pair: str(pair.frames))
    add_row("distance as recorded, median", lambda pair: _cm(pair.raw_median))
    add_row("distance as recorded, RMS", lambda pair: _cm(pair.raw_rms))
    add_row("distance calibrated, median", lambda pair: _cm(pair.median))
    add_row("distance calibrated, RMS", lambda pair: _cm(pair.rms))
    add_row("distance calibrated, RMS of inliers", lambda pair: _cm(pair.inlier_rms))
    add_row("rotation known to", lambda pair: f"{np.degrees(pair.rotation_stddev):.1f}°")
    table.add_row("clock ahead", *(_ahead(session, name) for name in residuals), end_section=True)
    add_row("inliers", lambda pair: f"{pair.all_inlier_share:.0%}", last=True)
    for joint in JOINTS:
        shares = [pair.inlier_share.get(joint) for pair in residuals.values()]
        table.add_row(joint, *("–" if share is None else f"{share:.0%}" for share in shares))
    return table


def _cm(length: float) -> str:
    return f"{length * 100.0:.1f} cm"


def _ahead(session: SessionCalibration, sensor: str) -> str:
    offset = session.clock_offsets[sensor]
    if not offset.observable:
        return "not observable"
    text = f"{offset.estimate_s * 1e3:.0f} ± {offset.stddev_s * 1e3:.0f} ms"
    drift = offset.clock.drift * 1e6 if offset.clock is not None else 0.0
    return f"{text}, {drift:+.0f} ppm"


def imus_line(imus: ImuFindings) -> str:
    """One line about the IMUs' common clock."""
    if not np.isfinite(imus.offset_stddev_s):
        return "the IMUs' clock: not determined by the motion"
    taken = "" if IMUS in imus.clocks else ", taken as 0: trackers' lags differ by as much"
    return (
        f"the IMUs' clock is {imus.offset_s * 1e3:.0f} ± {imus.offset_stddev_s * 1e3:.0f} ms "
        f"ahead{taken}"
    )


def main(given: list[str]) -> None:
    """Run with the arguments of the command line."""
    arguments = make_parser().parse_args(given)
    parameters = from_arguments(CalibrationParameters, arguments)
    check_folder_of(arguments.output)
    with open_bag(arguments.in_bag, arguments.remap) as bag:
        sensors = choose_sensors(bag, arguments.sensors)
        session = calibrate_bag(bag, sensors, parameters)
        remarks = bag.remarks
    save_extrinsics(arguments.output, session.extrinsics)
    console = Console(soft_wrap=True)
    console.print(agreement_table(session))
    extrinsics = session.extrinsics
    lines = (
        *remarks,
        session.people_line,
        *map(str, session.moved),
        *tracker_lines(extrinsics),
        "" if session.imus is None else imus_line(session.imus),
        *single_imu_lines(extrinsics.clocks),
        floor_line(extrinsics),
    )
    for line in filter(None, lines):
        print(line)
    print(f"{arguments.output}: {', '.join(extrinsics.sensors)}")
