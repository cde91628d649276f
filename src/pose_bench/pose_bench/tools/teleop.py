"""``./pose bench teleop``: a simulated robot follows people through a live graph that breaks."""

import argparse
import os
import signal
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from rich.console import Console

from pose_bench.processes import generate_session, pids_of, sleep_until
from pose_bench.speed import machine
from pose_bench.tables import percent
from pose_bench.teleop_scores import NotFollowedError, TeleopScores, score_teleop
from pose_bench.tools.showing import publish
from pose_core.errors import InputError
from pose_core.stamps import NS_PER_S
from pose_evaluation.table import Table, number, text_row
from pose_fusion.launched_graph import LaunchedGraph
from pose_io.recordings.formats import plain_csv
from pose_io.recordings.recording import make_recording, make_stream
from pose_node.command_line import add_option
from pose_sim.captured.clips import bundled_clips
from pose_sim.captured.session import CapturedSpec, make_captured_session

SUMMARY = "a simulated robot follows people through the live graph: error, latency, limits, faults"
LEAD_S = 25.0  # [s] from the graph's start to the session's first frame
FAULTS = ("kinect_bridge", "fusion", "arm", "simulated_robot")
"""Executables that are killed, one after the other; the launcher restarts them."""
FIRST_FAULT_S, BETWEEN_S = 35.0, 10.0  # [s] into the session
CLIPS = ("directing_traffic", "basketball", "soccer")  # clips with arm motion, 40 s
ROUNDS = 3  # repetitions of the clips


ROWS: dict[str, Callable[[TeleopScores], str]] = {
    "commands": lambda s: str(s.commands),
    "followed, of the time since the first command": lambda s: percent(s.followed),
    "tool error, median [mm]": lambda s: number(float(np.median(s.tool_mm)), 1),
    "tool error, 95 % [mm]": lambda s: number(float(np.percentile(s.tool_mm, 95.0)), 1),
    "latency, median [ms]": lambda s: number(float(np.median(s.latency_ms)), 1),
    "latency, 99 % [ms]": lambda s: number(float(np.percentile(s.latency_ms, 99.0)), 1),
    "jerk, 99 %, share of its limit": lambda s: number(s.jerk, 2),
    "commands beyond position [rad]": lambda s: number(s.beyond[0], 4, sign=True),
    "commands beyond velocity [share]": lambda s: number(s.beyond[1], 4, sign=True),
    "commands beyond acceleration [share]": lambda s: number(s.beyond[2], 4, sign=True),
    "robot beyond position [rad]": lambda s: number(s.robot_beyond[0], 4, sign=True),
    "robot beyond velocity [share]": lambda s: number(s.robot_beyond[1], 4, sign=True),
}
"""Functions from the scores of one person to a cell."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    add_option(parser, "--duration", 80.0, "of each session [s]", "S")
    parser.add_argument(
        "--only", choices=("synthetic", "captured"), help="one kind of people instead of both"
    )
    parser.add_argument("--no-faults", action="store_true", help="let nothing die")


def run(arguments: argparse.Namespace) -> int:
    """Measure and print; 1 if a command was beyond a limit."""
    if arguments.duration < FIRST_FAULT_S:
        raise InputError(f"duration = {arguments.duration:g} s: expected {FIRST_FAULT_S:g} or more")
    people = (arguments.only,) if arguments.only else ("synthetic", "captured")
    scores: dict[str, TeleopScores] = {}
    failed: list[str] = []
    with tempfile.TemporaryDirectory(prefix="pose_bench_teleop_") as folder:
        for person in people:
            with Console(stderr=True).status(f"{person} person, {arguments.duration:g} s"):
                try:
                    scores[person] = _run(person, arguments, Path(folder) / person)
                except NotFollowedError as error:
                    failed.append(f"{person}: {error}")
    tables = [_table(scores, arguments)]
    for line in failed:
        print(f"failed  {line}")
    publish(tables, "Tele-operation", arguments.output, "teleop.md")
    return int(bool(failed) or any(max(each.beyond) > 1e-9 for each in scores.values()))


def _run(person: str, arguments: argparse.Namespace, folder: Path) -> TeleopScores:
    folder.mkdir()
    making_s = 0.3 * arguments.duration + 10.0 if person == "synthetic" else 0.0
    start_ns = time.time_ns() + round((LEAD_S + making_s) * NS_PER_S)
    words = {"bag": str(folder / "bag"), "start_at": str(start_ns), "teleop": "true"}
    if person == "synthetic":
        launch = "demo.launch.yaml"
        generate_session(folder / "session", "arm_raises", arguments.duration, start_ns)
        words["session"] = str(folder / "session")
    else:
        launch = "capture.launch.yaml"
        recording = folder / "kinects.csv"
        _write_captured(recording, arguments.duration)
        start_ns = time.time_ns() + round(LEAD_S * NS_PER_S)
        words |= {"recording": str(recording), "sensor_left": "left", "sensor_right": "right"}
        words |= {"imus": "false", "view": "false", "start_at": str(start_ns)}
    with LaunchedGraph(launch, words, folder / "graph.log") as graph:
        due_s = FIRST_FAULT_S
        for name in () if arguments.no_faults else FAULTS:
            sleep_until(start_ns + round(due_s * NS_PER_S))
            _kill(graph.pid, name)
            due_s += BETWEEN_S
        sleep_until(start_ns + round(arguments.duration * NS_PER_S))
        graph.finish()
    return score_teleop(folder / "bag")


def _write_captured(path: Path, duration_s: float) -> None:
    """Write captured motion before two cameras as a recording."""
    clips = tuple(clip for clip in bundled_clips() if clip.name.startswith(CLIPS))
    spec = CapturedSpec(
        name="teleop",
        clips=clips * ROUNDS,
        trackers=("facing", "gross"),
        spins=False,
        seed=1,
        duration_s=duration_s,
    )
    session = make_captured_session(spec)
    streams = []
    for sensor, frames in session.frames.items():
        host_ns = np.round(frames.stamps_s * 1e9).astype(np.int64)
        streams.append(
            make_stream(
                sensor,
                host_time_ns=host_ns,
                sensor_time_ns=host_ns,
                person=["1"] * len(host_ns),
                positions=frames.positions,
                tracking_state=frames.tracking_state,
            )
        )
    note = "captured motion of CMU before simulated cameras, made by pose_sim"
    plain_csv.write(
        path, make_recording(path.name, "csv", streams, time_zero_ns=0, comments=[note])
    )


def _kill(root: int, name: str) -> None:
    """Kill the first process of an executable, to simulate a crash."""
    pids = pids_of(root, name)
    if not pids:
        raise InputError(f"the graph runs no {name} to kill: see its log")
    os.kill(pids[0], signal.SIGKILL)


def _table(scores: dict[str, TeleopScores], arguments: argparse.Namespace) -> Table:
    killed = "nothing died" if arguments.no_faults else f"killed meanwhile: {', '.join(FAULTS)}"
    return Table(
        caption="A simulated G1's left arm follows a person through the live graph",
        head="",
        columns=list(scores),
        rows=[text_row(name, *map(cell, scores.values())) for name, cell in ROWS.items()],
        note=f"{arguments.duration:g} s each; {killed}. Tool: distance from where the pose of the "
        "moment asks it to be, soft starts included. Latency: from the stamp that is followed to "
        f"the command in another process. Limits: positive is beyond. {machine()}.",
    )
