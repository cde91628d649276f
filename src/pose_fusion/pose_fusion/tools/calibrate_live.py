"""Calibrate the running sensors while a person walks about in view of them."""

import argparse

from rich.console import Console

from pose_calibration.files.extrinsics_file import save_extrinsics
from pose_calibration.live.live_calibration import LiveCalibration
from pose_calibration.live.parameters import LiveCalibrationParameters
from pose_core.errors import InputError
from pose_core.parameters import add_arguments, from_arguments
from pose_fusion.calibration_lines import extrinsics_lines
from pose_node.command_line import add_option, add_output, check_folder_of
from pose_node.plain_console import progress_bar


def make_parser() -> argparse.ArgumentParser:
    """The command line."""
    parser = argparse.ArgumentParser(prog="pose calibrate live", description=__doc__)
    add_output(parser, "the YAML to write")
    add_option(parser, "--timeout", 180.0, "give up after so long [s]")
    add_arguments(parser.add_argument_group("parameters"), LiveCalibrationParameters)
    return parser


def main(arguments: list[str]) -> None:
    """Run with the arguments that follow ``live``."""
    from pose_fusion.nodes.calibration import calibrate_live  # ROS only where it is wanted

    given = make_parser().parse_args(arguments)
    check_folder_of(given.output)
    if from_arguments(LiveCalibrationParameters, given).file:
        raise InputError("--file is the node's: name the YAML to write with -o")
    with progress_bar(Console(stderr=True)) as progress:
        task = progress.add_task("", total=1.0)

        def show(calibration: LiveCalibration) -> None:
            text = calibration.missing or calibration.status
            progress.update(task, completed=calibration.progress, description=text)

        extrinsics = calibrate_live(vars(given), given.timeout, show)
    save_extrinsics(given.output, extrinsics)
    for line in extrinsics_lines(extrinsics, "the motion seen live"):
        print(line)
    print(f"{given.output}: {', '.join(extrinsics.sensors)}")
