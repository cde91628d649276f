"""Estimate how each IMU sits on its segment, from motion; with the running sensors or on a bag.

The fusion runs until the sensor-to-segment alignments are certain enough.
"""

import argparse
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TypeVar

from rich.console import Console

from pose_calibration.files.extrinsics_file import load_extrinsics_of, save_extrinsics
from pose_calibration.geometry.rigid_transform import CalibrationError
from pose_calibration.imus.imu_calibration import ImuCalibration, ImuCalibrationResult
from pose_calibration.imus.parameters import ImuCalibrationParameters
from pose_calibration.imus.section import save_alignments
from pose_core.api import Extrinsics
from pose_core.parameters import add_arguments, from_arguments
from pose_fusion.session_extrinsics import checked_sensors, find_extrinsics
from pose_io.bag_samples import BagSamples
from pose_io.bags import BagReader, open_bag
from pose_io.renamed_topics import add_remap_argument
from pose_node.command_line import add_flag, add_option, add_output, check_folder_of
from pose_node.plain_console import progress_bar

Show = Callable[[float, str], None]
T = TypeVar("T")


def make_parser() -> argparse.ArgumentParser:
    """The command line."""
    parser = argparse.ArgumentParser(prog="pose calibrate imu", description=__doc__)
    parser.add_argument("in_bag", type=Path, nargs="?", help="a bag (default: the running sensors)")
    kept = "the session's YAML; if it exists, its poses of the Kinects are used and kept"
    add_output(parser, kept)
    add_option(parser, "--timeout", 180.0, "give up after so long [s]")
    add_flag(parser, "--keep-going", "save the other sensors although some are at fault")
    add_remap_argument(parser)
    add_arguments(parser.add_argument_group("parameters"), ImuCalibrationParameters)
    return parser


def calibrate_bag(
    bag: BagReader, parameters: ImuCalibrationParameters, extrinsics: Extrinsics, show: Show
) -> ImuCalibrationResult:
    """Calibrate the IMUs of a recorded session.

    Raises:
        CalibrationError: If it does not determine the calibration.
        InputError: If the bag is damaged.
    """
    calibration = ImuCalibration(parameters, extrinsics)
    samples = BagSamples(
        bag, parameters.person, lambda share: show(share, "reading"), extrinsics=extrinsics
    )
    for sample in samples:
        calibration.add(sample)
        if calibration.is_done:
            break
    for line in samples.left_out:
        Console(stderr=True).print(line, soft_wrap=True)
    return calibration.finish()


def _run_with_progress(work: Callable[[Show], T]) -> T:
    console = Console(stderr=True)
    with progress_bar(console) as progress:
        task = progress.add_task("", total=1.0)
        last_words = ""

        def show(share: float, text: str) -> None:
            nonlocal last_words
            progress.update(task, completed=share, description=text)
            words = text.split(" (")[0]
            if not console.is_terminal and words != last_words:
                last_words = words
                console.print(f"{share:.0%}  {text}", soft_wrap=True)

        return work(show)


def _report(result: ImuCalibrationResult, keep_going: bool) -> None:
    """Print the result; raise an error if a sensor has a fault."""
    console = Console(soft_wrap=True)
    for use in result.uses:
        console.print(f"IMU {use}")
    if result.faults and not keep_going:
        raise CalibrationError(
            f"nothing saved, {len(result.faults)} at fault: {result.faults[0]} (--keep-going "
            "saves the others)"
        )
    if not result.alignments:
        raise CalibrationError("nothing saved: no IMU could be aligned")


def main(arguments: list[str]) -> None:
    """Run with the arguments that follow ``imu``."""
    parser = make_parser()
    given = parser.parse_args(arguments)
    if given.in_bag is None and given.remap:
        parser.error("--remap is for a bag: of running sensors, remap the driver's topics")
    check_folder_of(given.output)
    parameters = from_arguments(ImuCalibrationParameters, given)
    extrinsics = None
    if given.output.exists():
        extrinsics = load_extrinsics_of(given.output, parameters.sensors)
    if given.in_bag is not None:
        with open_bag(given.in_bag, given.remap) as bag:
            checked_sensors(bag, parameters.sensors)
            say = partial(Console(stderr=True).print, soft_wrap=True)
            placed = extrinsics or find_extrinsics(bag, parameters.sensors, say)
            result = _run_with_progress(lambda show: calibrate_bag(bag, parameters, placed, show))
    else:
        from pose_fusion.nodes.live_imu_calibration import calibrate_imus_live  # ROS only here

        live = partial(calibrate_imus_live, parameters, extrinsics, given.timeout)
        result, placed = _run_with_progress(live)
    _report(result, given.keep_going)
    if extrinsics is None:
        save_extrinsics(given.output, placed)
    save_alignments(given.output, result.alignments)
    print(f"{given.output}: {', '.join(result.alignments)}")
