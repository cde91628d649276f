"""``demo``: the whole live graph on a synthetic subject or on a recording."""

import argparse
import contextlib
import json
import shutil
import time
from pathlib import Path
from typing import Any

from rich.console import Console

from pose_core.errors import InputError, writing
from pose_core.stamps import NS_PER_S
from pose_fusion.launched_graph import GraphError
from pose_fusion.own_domain import use_own_domain
from pose_fusion.recording.growing_bag import free_path
from pose_fusion.tools.demo_run import (
    DemoRun,
    Prepare,
    first_lead_s,
    ready_estimator,
    started_graph,
    watch,
)
from pose_node.child_process import executable, run_to_end
from pose_node.command_line import add_flag, add_option, add_path, run_tool
from pose_node.node_status import NodeStatus

OUT = Path("out")  # under the current directory
SYNTHETIC_S = 45.0  # [s] default length of a synthetic session
RECORDING_S = 60.0  # [s] default duration replayed of a recording
GENERATING = 0.06  # [-] initial estimate: time to generate a session over its duration


def main() -> None:
    """Entry point of the executable."""
    run_tool(run)


def inspect_recording(path: Path) -> dict[str, Any]:
    """Summary of a recording by ``inspect``, checked for the demo.

    Raises:
        InputError: If it cannot be read, or holds fewer than two sensors.
    """
    text = run_to_end([executable("kinect_bridge", "inspect"), path, "--json"])
    description: dict[str, Any] = json.loads(text)
    sensors = [sensor for sensor in description["sensors"] if sensor["frames"] > 0]
    if len(sensors) < 2:
        names = ", ".join(sensor["name"] for sensor in sensors) or "none"
        raise InputError(
            f"{path} holds {len(sensors)} camera ({names}): the demo fuses two, give a recording "
            "of two Kinects"
        )
    return description


def run() -> None:
    """Run the demo."""
    options = _parser().parse_args()
    console = Console(highlight=False, soft_wrap=True)
    recording = None if options.recording is None else inspect_recording(options.recording)
    folder = _output_folder(options)
    with writing(folder):
        folder.mkdir(parents=True)
    try:
        use_own_domain(console)
        ready_estimator(console)
        if recording is None:
            finished = _run_synthetic(options, folder, console)
        else:
            finished = _run_recording(options, recording, folder, console)
    except GraphError:
        raise  # its output has the reason
    except BaseException as error:
        shutil.rmtree(folder, ignore_errors=True)
        with contextlib.suppress(OSError):
            OUT.rmdir()  # if it is empty
        if isinstance(error, KeyboardInterrupt):
            console.print("interrupted: everything is stopped, nothing is left")
        raise
    with console.status("evaluating"):
        # Matplotlib and scipy take a second to load: not before the graph runs.
        from pose_fusion.tools.demo_report import report_recording, report_synthetic

        if recording is None:
            report_synthetic(finished, folder / "session" / "truth", console)
        else:
            report_recording(finished, console)


def _run_synthetic(options: argparse.Namespace, folder: Path, console: Console) -> DemoRun:
    duration_s = SYNTHETIC_S if options.duration is None else options.duration
    subject = _subject(options)
    console.print(
        f"{subject[0].upper()}{subject[1:]}, {duration_s:g} s; "
        f"two virtual Kinects{'' if options.no_imu else ', nine virtual IMUs'}"
    )

    def prepare(lead_s: float) -> tuple[int, dict[str, str]]:
        shutil.rmtree(folder / "session", ignore_errors=True)
        with console.status("making the session"):
            start_at_ns = _generate(options, duration_s, folder / "session", lead_s)
        arguments = {
            "session": str(folder / "session"),
            "imus": "false" if options.no_imu else "true",
            **_shown(options),
        }
        return start_at_ns, arguments

    nodes = run_graph("demo.launch.yaml", prepare, folder, duration_s, console)
    return DemoRun(folder=folder, subject=subject, nodes=nodes)


def _subject(options: argparse.Namespace) -> str:
    """Description of the subject."""
    if options.motion is None:
        return f"synthetic subject, {options.choreography}, seed {options.seed}"
    return f"captured motion {options.motion.name}, simulated sensors, seed {options.seed}"


def _generate(options: argparse.Namespace, duration_s: float, session: Path, lead_s: float) -> int:
    """Generate the synthetic session; returns its start [ns], at least ``lead_s`` ahead."""
    making_s = GENERATING * duration_s
    while True:
        begin = time.monotonic()
        start_at_ns = time.time_ns() + round((making_s + lead_s) * NS_PER_S)
        words = ["--choreography", options.choreography, "--duration", f"{duration_s:g}"]
        if options.motion is not None:
            words += ["--motion", str(options.motion)]
        words += ["--seed", str(options.seed), "--start-at", str(start_at_ns)]
        run_to_end([executable("pose_sim", "generate"), *words, "-o", session])
        if start_at_ns - time.time_ns() >= 0.8 * lead_s * NS_PER_S:
            return start_at_ns
        # The truth has these stamps: on a slow machine, repeat with a later start.
        making_s = 1.5 * (time.monotonic() - begin)
        shutil.rmtree(session)


def _run_recording(
    options: argparse.Namespace, recording: dict[str, Any], folder: Path, console: Console
) -> DemoRun:
    left, right, *others = (s["name"] for s in recording["sensors"] if s["frames"] > 0)
    whole_s = float(recording["duration_s"])
    limit_s = RECORDING_S if options.duration is None else options.duration
    duration_s = min(whole_s, limit_s)
    cut = f", {whole_s:.0f} s"
    if duration_s < whole_s:
        cut = f", the first {duration_s:.0f} of {whole_s:.0f} s (--duration sets how much)"
    console.print(
        f"Recording {options.recording.name}{cut}, at {options.rate:g} times its speed; "
        f"left is {left}, right is {right}"
    )
    if others:
        console.print(f"not used: {', '.join(others)}")

    def prepare(lead_s: float) -> tuple[int, dict[str, str]]:
        start_at_ns = time.time_ns() + round(lead_s * NS_PER_S)
        arguments = {
            "recording": str(options.recording.absolute()),
            "sensor_left": left,
            "sensor_right": right,
            "rate": str(float(options.rate)),
            "imus": "false",
            **_shown(options),
        }
        return start_at_ns, arguments

    played_s = duration_s / options.rate
    nodes = run_graph("capture.launch.yaml", prepare, folder, played_s, console)
    return DemoRun(folder=folder, subject=options.recording.name, nodes=nodes)


def run_graph(
    launch_file: str, prepare: Prepare, folder: Path, duration_s: float, console: Console
) -> dict[str, NodeStatus]:
    """Run a graph until its input of that duration [s] has ended; the last report of each node."""
    started = started_graph(launch_file, prepare, folder, first_lead_s(), console)
    with started as (graph, start_at_ns):
        watch(graph, start_at_ns, duration_s, console)
        graph.stop()
    return graph.nodes


def _shown(options: argparse.Namespace) -> dict[str, str]:
    """Arguments of the launch file for the page and the robot."""
    shown = {"view": str(options.view or options.teleop).lower()}
    if options.teleop:
        # The robot is at the position of the bodies for comparison.
        shown |= {"teleop": "true", "compare": "false", "bodies": "[subject]"}
    return shown


def _output_folder(options: argparse.Namespace) -> Path:
    """The folder to create: the given one, or the first free name under ``out``."""
    if options.output is not None:
        given: Path = options.output
        if given.exists():
            raise InputError(f"{given} exists already: name another folder, or remove it first")
        return given
    if options.motion is not None:
        name = options.motion.name.partition(".")[0]
    elif options.recording is None:
        name = options.choreography
    else:
        name = options.recording.name.removesuffix(".gz").removesuffix(".csv")
    return free_path(OUT / f"demo-{name}")


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="pose demo",
        description="Run the whole chain through a live node graph: on a synthetic subject's "
        "virtual Kinects and IMUs, compared with the truth; or on a recording of two real Kinects. "
        "Leaves a bag and a report.",
        epilog="Exit code: 0 if joint states came out, 1 if not, 130 if interrupted.",
    )
    parser.add_argument(
        "recording",
        nargs="?",
        type=Path,
        help="a KinectMultiTrack or plain CSV file, gzip or not, of two Kinects",
    )
    what = "what the synthetic subject does"
    add_option(parser, "--choreography", "leg_lift_march", what, "NAME")
    captured = "captured motion (.bvh, .bvh.gz) for the virtual sensors instead"
    add_path(parser, "--motion", "FILE", captured)
    parser.add_argument(
        "--duration",
        type=_positive,
        metavar="S",
        help=f"length [s] of the session (default: {SYNTHETIC_S:g}), or how much of a recording "
        f"to replay (default: its first {RECORDING_S:g} s)",
    )
    add_option(parser, "--seed", 1, "of the synthetic subject")
    add_flag(parser, "--view", "show it in the browser too, on http://127.0.0.1:8080")
    follow = (
        "have a simulated robot's arm follow the subject's left arm, and show both in the browser; "
        "needs ./pose build --teleop once"
    )
    add_flag(parser, "--teleop", follow)
    add_flag(parser, "--no-imu", "leave the virtual IMUs out")
    faster = "how many times faster than recorded to replay"
    add_option(parser, "--rate", 1.0, faster, type=_positive)
    parser.add_argument(
        "-o", "--output", type=Path, metavar="DIR", help="folder to make (default: out/demo-…)"
    )
    return parser


def _positive(text: str) -> float:
    value = float(text)
    if not 0.0 < value < float("inf"):
        raise argparse.ArgumentTypeError(f"{text} is not greater than 0")
    return value
