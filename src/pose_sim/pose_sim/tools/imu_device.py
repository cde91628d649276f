"""Replay a session's IMU nodes on a pseudo-terminal, in real time."""

import argparse
import signal
import sys
import time
from pathlib import Path

import numpy as np

from pose_common.command_line import run_tool
from pose_common.errors import InputError
from pose_sim import imu_file
from pose_sim.serial_device import PseudoTerminal, over_the_air, transmit
from pose_sim.session_folder import IMU_FILE

NS_PER_S = 1_000_000_000


def make_parser() -> argparse.ArgumentParser:
    """The command line."""
    parser = argparse.ArgumentParser(
        prog="imu_device",
        description="A virtual serial device: sends the IMU frames of a synthetic session, in real "
        "time, on a pseudo-terminal. It ends with the session.",
    )
    parser.add_argument("session", type=Path, help="folder that 'generate' made")
    parser.add_argument(
        "--link", type=Path, required=True, metavar="PATH", help="name under which to find it"
    )
    parser.add_argument(
        "--start-at",
        type=int,
        metavar="NS",
        help="UNIX time [ns] of the session's time zero (default: now)",
    )
    parser.add_argument(
        "--lost",
        type=float,
        default=0.002,
        metavar="SHARE",
        help="frames lost (default: %(default)g)",
    )
    parser.add_argument(
        "--corrupted",
        type=float,
        default=0.0005,
        metavar="SHARE",
        help="frames with a wrong byte (default: %(default)g)",
    )
    parser.add_argument(
        "--jitter",
        type=float,
        default=0.0,
        metavar="S",
        help="mean delay on top of the session's own [s] (default: %(default)g)",
    )
    parser.add_argument("--seed", type=int, default=1, help="of all chance (default: %(default)s)")
    return parser


def run() -> int:
    """Read the command line, send the session."""
    arguments = make_parser().parse_args()
    for name in ("lost", "corrupted"):
        if not 0.0 <= getattr(arguments, name) <= 1.0:
            raise InputError(f"{name} = {getattr(arguments, name):g} is outside [0, 1]")
    if not 0.0 <= arguments.jitter <= 1.0:
        raise InputError(f"jitter = {arguments.jitter:g} s is outside [0, 1]")
    if arguments.seed < 0:
        raise InputError(f"seed = {arguments.seed} is negative")
    stop_signals: list[int] = []
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda number, _: stop_signals.append(number))
    frames, note = imu_file.read(arguments.session / IMU_FILE)
    transmission = over_the_air(
        frames.due_ns,
        imu_file.encode_all(frames),
        lost=arguments.lost,
        corrupted=arguments.corrupted,
        jitter_s=arguments.jitter,
        rng=np.random.default_rng(arguments.seed),
    )
    with PseudoTerminal(arguments.link) as terminal:
        start_ns = time.time_ns() if arguments.start_at is None else arguments.start_at
        print(f"{arguments.link} -> {terminal.device}: {note}", file=sys.stderr, flush=True)
        sent = transmit(terminal, transmission, start_ns, stopped=lambda: bool(stop_signals))
    print(
        f"imu_device: {'finished' if sent.finished else 'stopped'}: {sent.sent} of "
        f"{len(frames.due_ns)} synthetic frames sent; of all, {transmission.lost} lost and "
        f"{transmission.corrupted} garbled on the air, {sent.skipped} past already; "
        f"{terminal.counters['bytes_unread']} bytes unread"
    )
    return 0


def main() -> None:
    """Run the tool and exit."""
    run_tool(run)
