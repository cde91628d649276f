"""Generate a session of the synthetic subject: the files that the virtual devices replay."""

import argparse
import sys

from pose_core.errors import InputError
from pose_node.command_line import add_option, add_output, add_path, run_tool
from pose_sim.captured.clips import read_clip
from pose_sim.captured.motion import motion_of
from pose_sim.choreography import CHOREOGRAPHIES
from pose_sim.scene import subject_place
from pose_sim.session import NOISE_PRESETS, make_session, read_overrides, settings_of
from pose_sim.session_folder import note_of, write_session

LATEST_NS = 2_000_000_000 * 10**9  # [ns] a ROS stamp ends at 2**31 s


def make_parser() -> argparse.ArgumentParser:
    """The command line."""
    parser = argparse.ArgumentParser(
        prog="generate",
        description="Make a session of the synthetic subject: two Kinects' skeletons, nine IMU "
        "nodes' frames, and the truth as a bag. Nothing in it comes from a person.",
    )
    add_output(parser, "folder to make")
    names = ", ".join(CHOREOGRAPHIES)
    add_option(parser, "--choreography", "leg_lift_march", f"one of {names}")
    captured = "perform the captured motion of a .bvh, .bvh.gz or .npz file instead"
    add_path(parser, "--motion", "FILE", captured)
    add_option(parser, "--duration", 60.0, "[s]", "S")
    add_option(parser, "--seed", 1, "of all chance")
    zero = "stamp of the session's time zero in the truth, UNIX time [ns]"
    add_option(parser, "--start-at", 0, zero, "NS")
    add_option(parser, "--noise", "typical", f"one of {', '.join(NOISE_PRESETS)}")
    different = "YAML: parameters of scene, variation, kinect, imu that differ from the preset"
    add_path(parser, "--params", "FILE", different)
    return parser


def run() -> None:
    """Parse the command line, generate the session and write it."""
    arguments = make_parser().parse_args()
    overrides = read_overrides(arguments.params) if arguments.params else None
    settings = settings_of(arguments.noise, overrides)
    if arguments.start_at < 0 or arguments.seed < 0:
        raise InputError(
            f"seed = {arguments.seed}, start-at = {arguments.start_at} ns: neither may be negative"
        )
    if arguments.start_at > LATEST_NS:
        raise InputError(f"start-at = {arguments.start_at} ns is not UNIX time [ns]: `date +%s%N`")
    name, captured = arguments.choreography, None
    if arguments.motion:
        clip = read_clip(arguments.motion)
        place, heading = subject_place(settings.scene)
        name = clip.name
        captured = motion_of(clip, arguments.duration, place=place, facing=heading)
    session = make_session(name, arguments.duration, arguments.seed, settings, captured)
    print(note_of(session), file=sys.stderr)
    write_session(arguments.output, session, arguments.start_at)
    frames = {name: len(frames.host_time_ns) for name, frames in session.kinects.items()}
    print(
        f"{arguments.output}: {session.duration:g} s, "
        + ", ".join(f"{count} frames of kinect_{name}" for name, count in frames.items())
        + f", {len(session.imus.due_ns)} of {len(session.nodes)} IMU nodes"
    )


def main() -> None:
    """Run the tool and exit."""
    run_tool(run)
