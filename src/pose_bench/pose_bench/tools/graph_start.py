"""How long ``./pose up`` takes to the first joint state in another process."""

import json
import subprocess
import sys
import time
from pathlib import Path

from pose_bench.tools.live_graph import stopped
from pose_core.errors import InputError
from pose_core.stamps import NS_PER_S
from pose_fusion.tools.demo_processes import executable, run_to_end, start, stop

PROBE_S = 4.0  # [s] until the probe listens
WATCHED_S = 12.0  # [s] for which the graph runs
LAUNCH_FILE = "capture.launch.yaml"
PARAMETERS = "/**:\n  ros__parameters:\n    extrinsics_file: {}\n"


def first_state_s(session: Path, bag: Path, folder: Path) -> float:
    """Replay a session's Kinects with places and measures that are known; time to the first state.

    Args:
        session: Folder of a synthetic session.
        bag: What was recorded of it: places and measures are taken from there.
        folder: Where the files and the log go.

    Returns:
        Time [s] from the command's start to the arrival of the first joint state.

    Raises:
        PoseError: If none arrived.
    """
    known, parameters = folder / "extrinsics.yaml", folder / "start_fusion.yaml"
    if not known.exists():
        run_to_end([executable("pose_fusion", "calibrate"), bag, "-o", known])
    parameters.write_text(PARAMETERS.format(known))
    arguments = {
        "recording": str(session / "kinects.csv"),
        "format": "csv",
        "sensor_left": "left",
        "sensor_right": "right",
        "view": "false",
        "record": "false",
        "bag": str(folder / "nothing"),
        "extrinsics_file": str(known),
        "params": str(parameters),
    }
    words = [f"{name}:={value}" for name, value in arguments.items()]
    probe = start([sys.executable, "-m", "pose_bench.nodes.latency_probe"], stdout=subprocess.PIPE)
    try:
        time.sleep(PROBE_S)
        begin_ns = time.time_ns()
        with (folder / "start.log").open("w") as log:
            command: list[str | Path] = [executable("pose_launch", "up"), LAUNCH_FILE, *words]
            graph = start(command, stdout=log, stderr=subprocess.STDOUT)
            try:
                time.sleep(WATCHED_S)
            finally:
                stop(graph)
    finally:
        output = stopped(probe)
    arrived = json.loads(output)["arrived"].values()
    if not arrived:
        raise InputError(f"no joint state came within {WATCHED_S:g} s: see {folder}/start.log")
    return (min(arrived) - begin_ns) / NS_PER_S
