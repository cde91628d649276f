"""``./pose export BAG --to FORMAT -o FILE``: converts a recorded motion for other programs."""

import argparse
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import TimeRemainingColumn

from pose_core.api import load_body_model
from pose_core.atomic_file import write_atomically
from pose_core.errors import InputError, writing
from pose_io.bags import open_bag
from pose_io.export.exporter import ExportOptions
from pose_io.export.motion import BodyMotion, read_motion
from pose_io.export.opensim import OPENSIM_MODELS
from pose_io.export.registry import EXPORTERS
from pose_node.command_line import add_option, add_output, number_within, run_tool
from pose_node.many import add_many_arguments, run_many
from pose_node.plain_console import add_share, progress_bar

SLOWEST, FASTEST = 1.0, 1000.0  # [Hz]
NOTABLE_RESIDUAL = 0.001  # [m]


def parse_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(
        prog="pose export",
        description=__doc__,
        epilog="Conventions of each format: docs/export.md.",
    )
    parser.add_argument("bag", type=Path, help="a bag with a fused pose, or a folder of bags")
    formats = "; ".join(f"{name}: {each.doc}" for name, each in EXPORTERS.items())
    parser.add_argument("--to", required=True, choices=EXPORTERS, metavar="FORMAT", help=formats)
    add_output(parser, "the file to write; replaced if it exists; of many bags, the files' folder")
    parser.add_argument(
        "--body",
        default="",
        help="the person's id (default: the only one; bodies fused for comparison do not count)",
    )
    parser.add_argument(
        "--rate",
        type=number_within(SLOWEST, FASTEST, "Hz"),
        metavar="HZ",
        help="resample to a constant rate, such as 30, 60 or 100 (default: trc, mot, bvh and c3d: "
        "the bag's, rounded; csv and json: every instant as it is)",
    )
    parser.add_argument(
        "--body-model",
        metavar="FILE",
        help="the body model that the bag was fused with, if it was one of your own",
    )
    mot = "whose conventions the mot follows"
    add_option(parser, "--opensim-model", "rajagopal2016", mot, choices=OPENSIM_MODELS)
    add_many_arguments(parser)
    return parser.parse_args(arguments)


def summary(
    recorded: BodyMotion, written: BodyMotion, arguments: argparse.Namespace, rate: float
) -> list[str]:
    """Summary of the written file, with its limitations."""
    duration_s = float(written.times_s[-1])
    exporter = EXPORTERS[arguments.to]
    own = written is recorded
    spacing = "each with its own stamp" if own else f"at {rate:g} Hz"
    lines = [f"{arguments.output}: {len(written)} frames of '{written.body}', {spacing}"]
    lines[0] += f", {duration_s:.1f} s, {written.model.size} degrees of freedom"
    gaps = int(np.sum(written.is_gap))
    if gaps:
        what = "they are left out" if arguments.to == "json" else "their joints are left empty"
        what = "they are interpolated" if exporter.fills_gaps else what
        lines.append(f"{gaps} frames lie in gaps of the recording: {what}")
    if exporter.unknown_angles and written.is_unknown.any():
        lines.append(f"{unknown_line(written)}: {exporter.unknown_angles}")
    usual, largest = recorded.rigid_residuals
    if exporter.rigid_bones and largest > NOTABLE_RESIDUAL:
        lines.append(
            f"{arguments.to.upper()} has the angles on rigid bones: joints differ from the "
            f"recorded ones by {1000.0 * usual:.0f} mm in median, at most {1000.0 * largest:.0f} mm"
        )
    return lines


def unknown_line(motion: BodyMotion) -> str:
    """Which angles the fusion does not know, in how many frames and for how long."""
    changes = np.diff(motion.is_unknown.astype(np.int8), axis=0, prepend=0, append=0)
    begins, ends = (np.argwhere(change == changes.T)[:, 1] for change in (1, -1))
    times_s = motion.times_s
    durations_s = times_s[np.minimum(ends, len(motion) - 1)] - times_s[begins]
    longest = int(np.argmax(durations_s))
    names = np.array(motion.model.dof_names)[motion.is_unknown.any(axis=0)]
    return (
        f"angles unknown to the fusion in {motion.is_unknown.any(axis=1).sum()} of {len(motion)} "
        f"frames, for up to {durations_s[longest]:.1f} s, from {times_s[begins[longest]]:.1f} s on "
        f"({', '.join(names)})"
    )


def run() -> int | None:
    """Run the tool; returns the exit status."""
    arguments = parse_arguments()
    status = run_many(arguments.bag, arguments.output, arguments, f".{arguments.to}")
    if status is not None:
        return status
    if arguments.output.is_dir():
        raise InputError(f"cannot write {arguments.output}: it is a folder, name a file")
    with writing(arguments.output):
        arguments.output.parent.mkdir(parents=True, exist_ok=True)
    console = Console(stderr=True)
    with open_bag(arguments.bag) as bag, progress_bar(console, TimeRemainingColumn()) as progress:
        model = load_body_model(arguments.body_model) if arguments.body_model else None
        recorded = read_motion(bag, arguments.body, add_share(progress, "reading"), model)
        progress.add_task("writing", total=None)
        rate = arguments.rate or max(SLOWEST, float(round(recorded.mean_rate)))
        exporter = EXPORTERS[arguments.to]
        keeps_stamps = not exporter.constant_rate and arguments.rate is None
        written = recorded if keeps_stamps else recorded.at_rate(rate)
        options = ExportOptions(
            file_name=arguments.output.name, rate=rate, opensim_model=arguments.opensim_model
        )
        content = exporter.content(written, options)
        write_atomically(arguments.output, content, "the motion", mode=0o666)
    for line in summary(recorded, written, arguments, rate):
        print(line)
    return None


def main() -> None:
    """Run the tool and exit."""
    run_tool(run)
