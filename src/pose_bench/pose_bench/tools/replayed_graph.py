"""The live graph to which a fault player replays messages: its start."""

import subprocess
import time
from collections.abc import Mapping
from pathlib import Path

from pose_bench.nodes.fault_player import FaultPlayer
from pose_calibration.files.extrinsics_file import save_extrinsics
from pose_core.api import extrinsics_from_map
from pose_core.arrays import FloatArray
from pose_core.errors import InputError
from pose_fusion.launched_graph import launch, up_command

START_S = 900.0  # [s] time limit of the graph's start, which may compile


def start_graph(
    folder: Path, T_map_sensor: Mapping[str, FloatArray], **arguments: str
) -> "subprocess.Popen[str]":
    """Start calibration, fusion and recorder; their files are in the folder.

    Args:
        folder: Folder of extrinsics, log and bag.
        T_map_sensor: Poses of the cameras, (4, 4), known to the fusion.
        **arguments: Further arguments of the launch file.
    """
    session = folder / "session.yaml"
    save_extrinsics(session, extrinsics_from_map(T_map_sensor))
    arguments |= {"extrinsics_file": str(session), "bag": str(folder / "bag")}
    return launch(up_command("fusion.launch.yaml", arguments), folder / "graph.log")


def await_graph(player: FaultPlayer, graph: "subprocess.Popen[str]", folder: Path) -> None:
    """Wait until fusion and calibration report."""
    end_s = time.monotonic() + START_S
    while not (player.has_said("/fusion") and player.has_said("/calibration")):
        if graph.poll() is not None or time.monotonic() > end_s:
            raise InputError(f"the graph did not start: see {folder / 'graph.log'}")
        time.sleep(0.1)
