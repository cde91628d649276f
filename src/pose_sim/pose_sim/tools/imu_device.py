"""Replay a session's IMU nodes on pseudo-terminals, in real time."""

import argparse
import signal
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, closing
from functools import partial
from pathlib import Path

import numpy as np

from pose_core.errors import InputError, writing
from pose_core.plain_yaml import dump_yaml
from pose_node.command_line import add_option, add_path, number_within, run_tool
from pose_sim import imu_file
from pose_sim.imu_devices import BAUDRATES, nodes_file, port_streams
from pose_sim.serial_device import PseudoTerminal, over_the_air, transmit
from pose_sim.session_folder import IMU_FILE
from pose_sim.virtual_imu import NODES


def make_parser() -> argparse.ArgumentParser:
    """The command line."""
    parser = argparse.ArgumentParser(
        prog="imu_device",
        description="Virtual serial devices: they send the IMU samples of a synthetic session, in "
        "real time, on pseudo-terminals. They end with the session.",
    )
    parser.add_argument("session", type=Path, help="folder that 'generate' made")
    parser.add_argument(
        "--link",
        type=Path,
        required=True,
        metavar="PATH",
        help="path of the link to the terminal; with one sensor per port, PATH_SEGMENT",
    )
    kind = "kind of device: the star network's sink, or a sensor per port"
    add_option(parser, "--device", "star", kind, choices=tuple(BAUDRATES))
    add_path(parser, "--nodes-file", "PATH", "write a nodes file for imu_bridge here")
    parser.add_argument(
        "--start-at",
        type=int,
        metavar="NS",
        help="UNIX time [ns] of the session's time zero (default: now)",
    )
    for name, default, unit, metavar, meaning in (
        ("--lost", 0.002, "-", "SHARE", "frames lost"),
        ("--corrupted", 0.0005, "-", "SHARE", "frames with a wrong byte"),
        ("--jitter", 0.0, "s", "S", "mean delay on top of the session's own [s]"),
    ):
        add_option(parser, name, default, meaning, metavar, type=number_within(0.0, 1.0, unit))
    add_option(parser, "--seed", 1, "of all chance")
    return parser


def run() -> int:
    """Parse the command line and send the session."""
    arguments = make_parser().parse_args()
    if arguments.seed < 0:
        raise InputError(f"seed = {arguments.seed} is negative")
    stop_signals: list[int] = []
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda number, _: stop_signals.append(number))
    frames, note = imu_file.read(arguments.session / IMU_FILE)
    rng = np.random.default_rng(arguments.seed)
    transmissions = {
        _link(arguments.link, segment): over_the_air(
            due_ns,
            pieces,
            lost=arguments.lost,
            corrupted=arguments.corrupted,
            jitter_s=arguments.jitter,
            rng=rng,
        )
        for segment, (due_ns, pieces) in port_streams(arguments.device, frames).items()
    }
    with ExitStack() as stack:
        terminals = [
            stack.enter_context(closing(PseudoTerminal(link, BAUDRATES[arguments.device])))
            for link in transmissions
        ]
        if arguments.nodes_file is not None:
            _write_nodes_file(arguments)
        start_ns = time.time_ns() if arguments.start_at is None else arguments.start_at
        for terminal in terminals:
            print(f"{terminal.link} -> {terminal.device}: {note}", file=sys.stderr, flush=True)
        with ThreadPoolExecutor(len(terminals)) as pool:
            send = partial(transmit, start_ns=start_ns, stopped=lambda: bool(stop_signals))
            sent = list(pool.map(send, terminals, transmissions.values()))
    print(
        f"imu_device: {'finished' if all(s.finished for s in sent) else 'stopped'}: "
        f"{sum(s.sent for s in sent)} of {len(frames.due_ns)} synthetic frames sent; of all, "
        f"{sum(t.lost for t in transmissions.values())} lost and "
        f"{sum(t.corrupted for t in transmissions.values())} corrupted by the radio link, "
        f"{sum(s.skipped for s in sent)} past already; "
        f"{sum(t.counters['bytes_unread'] for t in terminals)} bytes unread"
    )
    return 0


def _link(link: Path, segment: str | None) -> Path:
    return link if segment is None else link.with_name(f"{link.name}_{segment}")


def _write_nodes_file(arguments: argparse.Namespace) -> None:
    ports = {segment: str(_link(arguments.link, segment)) for segment in NODES.values()}
    with writing(arguments.nodes_file):
        arguments.nodes_file.write_text(dump_yaml(nodes_file(arguments.device, ports)))


def main() -> None:
    """Run the tool and exit."""
    run_tool(run)
