"""Replays sessions with faults to a graph of real processes."""

import os
import signal
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from rich.console import Console

from pose_bench.captured import truth_of
from pose_bench.faults.fault import Fault, Signal, Window
from pose_bench.faults.judging import RECOVERY_S, FaultResult, Poses, judge
from pose_bench.faults.messages import Planned, planned
from pose_bench.faults.packets import Packet, packets_of
from pose_bench.nodes.fault_player import FaultPlayer
from pose_bench.processes import pids_of
from pose_bench.replayed_person import SESSION_S, captured_person
from pose_bench.tools.replayed_graph import await_graph, start_graph
from pose_core.api import ImuSample, SkeletonSample, extrinsics_from_map
from pose_core.stamps import NS_PER_S
from pose_evaluation.offline import MethodSetup, run_methods
from pose_fusion.own_domain import use_own_domain
from pose_node.child_process import stop
from pose_sim.captured.session import START_NS, CapturedSession

WARM_S = 14.0  # [s] before the first fault: calibration, body measures, alignment of IMUs
LEAD_S = 4.0  # [s] from the start of the plan to the first frame
SETUP = MethodSetup(name="default", estimator="default", use_imus=True)
SIGNALS = {"kill": signal.SIGKILL, "pause": signal.SIGSTOP, "resume": signal.SIGCONT}


@dataclass(frozen=True, kw_only=True)
class Slot:
    """A fault and its start [s] in a session."""

    fault: Fault
    begin_s: float

    @property
    def end_s(self) -> float:
        """The fault's end [s]."""
        return self.begin_s + self.fault.lasts_s


def sessions(faults: Sequence[Fault]) -> list[list[Slot]]:
    """Distribute faults over sessions, one after the other."""
    found: list[list[Slot]] = []
    at_s = SESSION_S
    for fault in faults:
        if at_s + fault.lasts_s + RECOVERY_S > SESSION_S:
            found.append([])
            at_s = WARM_S
        found[-1].append(Slot(fault=fault, begin_s=at_s))
        at_s += fault.lasts_s + RECOVERY_S
    return found


def run_faults(
    faults: Sequence[Fault], folder: Path, say: Callable[[str], None]
) -> Iterator[FaultResult]:
    """Inject faults; yields results session by session.

    Args:
        faults: The faults.
        folder: Folder for the graphs' logs.
        say: Called with progress messages.
    """
    person = captured_person()
    plan = sessions(faults)
    use_own_domain(Console(stderr=True))
    for number, slots in enumerate(plan):
        names = ", ".join(slot.fault.name for slot in slots)
        say(f"session {number + 1} of {len(plan)}: {names}")
        yield from _run_session(person, slots, folder / f"session-{number:02d}", say)


def _run_session(
    person: CapturedSession, slots: Sequence[Slot], folder: Path, say: Callable[[str], None]
) -> Iterator[FaultResult]:
    folder.mkdir(parents=True, exist_ok=True)
    packets = _packets(person, slots)
    plan = [planned(packet) for packet in packets]  # for a start at START_NS
    player = FaultPlayer()
    graph = start_graph(folder, person.T_map_sensor)
    try:
        player.open(plan)
        await_graph(player, graph, folder)
        plan, start_ns = _plan_ahead(packets)
        acts = _acts(slots, graph.pid)
        player.play(plan, acts, start_ns, slots[-1].end_s + RECOVERY_S)
        heard = player.heard()
    finally:
        stop(graph)
        player.close()
    if player.latest_s > 0.05:
        say(f"the machine was busy: replayed {player.latest_s * 1e3:.0f} ms late at worst")
    truth = truth_of(person, start_ns)
    reference = _reference(person, slots, start_ns)
    for slot in slots:
        yield judge(slot.fault, heard, truth, reference, start_ns + round(slot.begin_s * NS_PER_S))


def _packets(person: CapturedSession, slots: Sequence[Slot]) -> list[Packet]:
    packets = packets_of(person)
    for slot in slots:
        if slot.fault.change is not None:
            # Of the name, so that it is the same in every run.
            rng = np.random.default_rng(int.from_bytes(slot.fault.name.encode()[-8:], "little"))
            packets = slot.fault.change(packets, Window(slot.begin_s, slot.end_s, rng))
    return packets


def _shifted(packets: Sequence[Packet], by_ns: int) -> list[Packet]:
    """Shift the stamps to another start, except for implausible ones."""
    return [
        replace(packet, stamp_ns=packet.stamp_ns + by_ns) if packet.stamp_ns else packet
        for packet in packets
    ]


def _plan_ahead(packets: Sequence[Packet]) -> tuple[list[Planned], int]:
    """A plan that starts soon, and its start [ns]; planning takes a while on a busy machine."""
    lead_s = LEAD_S
    while True:
        start_ns = time.time_ns() + round(lead_s * NS_PER_S)
        plan = [planned(packet) for packet in _shifted(packets, start_ns - START_NS)]
        if time.time_ns() < start_ns:
            return plan, start_ns
        lead_s *= 2.0


def _acts(slots: Sequence[Slot], launcher: int) -> list[tuple[float, Callable[[], None]]]:
    """Actions on processes with their times [s]."""

    def act(what: Signal) -> None:
        for pid in pids_of(launcher, what.node):
            os.kill(pid, SIGNALS[what.what])

    return [
        (slot.begin_s + each.after_s, partial(act, each))
        for slot in slots
        for each in slot.fault.signals
    ]


def _reference(person: CapturedSession, slots: Sequence[Slot], start_ns: int) -> Poses:
    """Bodies fused from the undisturbed samples without the lost sources."""

    def is_lost(sample: SkeletonSample | ImuSample) -> bool:
        at_s = (sample.stamp_ns - START_NS) / NS_PER_S
        if isinstance(sample, SkeletonSample):
            names = {sample.sensor}
        else:
            names = {f"imu/{sample.segment}", "imus"}
        return any(
            slot.begin_s <= at_s < slot.end_s and not names.isdisjoint(slot.fault.lost)
            for slot in slots
        )

    samples = [sample for sample in person.samples(imus=True) if not is_lost(sample)]
    extrinsics = extrinsics_from_map(person.T_map_sensor)
    series = run_methods(samples, [SETUP], extrinsics)["default"].series
    stamps_ns = series.stamps_ns - START_NS + start_ns
    return Poses(stamps_ns=stamps_ns, arrived_ns=stamps_ns, values=series.positions)
