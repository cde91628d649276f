"""``./pose export BAG --to FORMAT -o FILE``: a recorded motion for other programs."""

import argparse
import os
import tempfile
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from pose_core.errors import InputError
from pose_io.bags import open_bag
from pose_io.export.bvh import bvh_text
from pose_io.export.c3d_file import c3d_bytes
from pose_io.export.motion import BodyMotion, read_motion
from pose_io.export.opensim import mot_text, trc_text
from pose_io.export.opensim_coordinates import OPENSIM_MODELS
from pose_io.export.tables import csv_text, json_lines_text
from pose_node.command_line import run_tool

FORMATS = {
    "trc": "joints as markers, for OpenSim",
    "mot": "joint angles by OpenSim's names and signs",
    "bvh": "the moving skeleton, for Blender",
    "c3d": "joints as points, for biomechanics programs",
    "csv": "angles, joints and segments, for spreadsheets",
    "json": "JSON lines {segment: position, quaternion}, for robot retargeting",
}
OWN_STAMPS = ("csv", "json")  # the others want a constant rate
SLOWEST, FASTEST = 1.0, 1000.0  # [Hz]
NOTABLE_RESIDUAL = 0.001  # [m]


def parse_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(
        prog="pose export",
        description=__doc__,
        epilog="Conventions of each format: docs/export.md.",
    )
    parser.add_argument("bag", type=Path, help="a bag with a fused pose (of a session, or fused)")
    formats = "; ".join(f"{name}: {text}" for name, text in FORMATS.items())
    parser.add_argument("--to", required=True, choices=FORMATS, metavar="FORMAT", help=formats)
    parser.add_argument(
        "-o", "--output", type=Path, required=True, help="the file to write; replaced if it exists"
    )
    parser.add_argument(
        "--body",
        default="",
        help="the person's id (default: the only one; bodies fused for comparison do not count)",
    )
    parser.add_argument(
        "--rate",
        type=_rate,
        metavar="HZ",
        help="constant rate of trc, mot, bvh and c3d (default: the bag's, rounded); csv and json "
        "keep every instant",
    )
    parser.add_argument(
        "--opensim-model",
        choices=OPENSIM_MODELS,
        default="rajagopal2016",
        help="whose conventions the mot follows (default: rajagopal2016)",
    )
    return parser.parse_args(arguments)


def _rate(text: str) -> float:
    value = float(text)
    if not SLOWEST <= value <= FASTEST:
        raise argparse.ArgumentTypeError(f"{text} Hz is outside [{SLOWEST:g}, {FASTEST:g}]")
    return value


def content_of(motion: BodyMotion, arguments: argparse.Namespace, rate: float) -> bytes:
    """What the file will hold.

    Args:
        motion: At the constant rate, if the format wants one.
        arguments: The command line.
        rate: [Hz]
    """
    path: Path = arguments.output
    if arguments.to == "c3d":
        return c3d_bytes(motion, rate)
    text = {
        "trc": lambda: trc_text(motion, rate, path.name),
        "mot": lambda: mot_text(motion, OPENSIM_MODELS[arguments.opensim_model], path.stem),
        "bvh": lambda: bvh_text(motion, rate),
        "csv": lambda: csv_text(motion),
        "json": lambda: json_lines_text(motion),
    }[arguments.to]()
    return text.encode()


def write_whole(path: Path, content: bytes) -> None:
    """Write a file, whole or not at all.

    Raises:
        InputError: If it cannot be written.
    """
    temporary = None
    try:
        handle, temporary = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
        with os.fdopen(handle, "wb") as file:
            file.write(content)
        umask = os.umask(0)
        os.umask(umask)
        os.chmod(temporary, 0o666 & ~umask)
        os.replace(temporary, path)
    except OSError as error:
        raise InputError(f"cannot write {path}: {error.strerror}") from error
    finally:
        if temporary is not None and os.path.exists(temporary):
            os.unlink(temporary)


def summary(
    recorded: BodyMotion, written: BodyMotion, arguments: argparse.Namespace, rate: float
) -> list[str]:
    """What was written, and what a reader of it has to know."""
    duration_s = float(written.times_s[-1])
    own = arguments.to in OWN_STAMPS
    spacing = "each with its own stamp" if own else f"at {rate:g} Hz"
    lines = [f"{arguments.output}: {len(written)} frames of '{written.body}', {spacing}"]
    lines[0] += f", {duration_s:.1f} s, {written.model.size} degrees of freedom"
    gaps = int(np.sum(written.is_gap))
    if gaps and arguments.to in ("mot", "bvh"):
        lines.append(f"{gaps} frames lie in gaps of the recording: they are interpolated")
    elif gaps:
        lines.append(f"{gaps} frames lie in gaps of the recording: their joints are left empty")
    residual = recorded.rigid_residual
    if arguments.to == "bvh" and residual > NOTABLE_RESIDUAL:
        lines.append(
            f"BVH's bones are rigid, the recorded ones are not: joints differ by up to "
            f"{1000.0 * residual:.0f} mm"
        )
    return lines


def run() -> None:
    """The tool."""
    arguments = parse_arguments()
    if not arguments.output.parent.is_dir() or arguments.output.is_dir():
        raise InputError(f"cannot write {arguments.output}: expected a file in an existing folder")
    console = Console(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.percentage:.0f} %"))
    with (
        open_bag(arguments.bag) as bag,
        Progress(
            *columns,
            TimeRemainingColumn(),
            console=console,
            transient=True,
            disable=not console.is_terminal,
        ) as progress,
    ):
        task = progress.add_task("reading", total=1.0)
        recorded = read_motion(
            bag, arguments.body, lambda share: progress.update(task, completed=share)
        )
        progress.update(task, description="writing", total=None)
        rate = arguments.rate or max(SLOWEST, float(round(recorded.mean_rate)))
        written = recorded if arguments.to in OWN_STAMPS else recorded.at_rate(rate)
        write_whole(arguments.output, content_of(written, arguments, rate))
    for line in summary(recorded, written, arguments, rate):
        print(line)


def main() -> None:
    """Run the tool and exit."""
    run_tool(run)
