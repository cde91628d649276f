"""The node's state in ``/diagnostics``."""

import math
from collections.abc import Sequence

import numpy as np

from imu_bridge.devices import PortConfig
from imu_bridge.pipeline import ImuPipeline, NodeState
from imu_bridge.protocols import PROTOCOLS
from imu_bridge.segments import ImuNode
from imu_bridge.serial_source import PortState, SerialSource
from pose_node.node_status import Level, Report

DEAF_BYTES = 100  # [bytes] without a packet: wrong speed or protocol
UNKNOWN_NAMED = 16  # [-] largest number of unknown ids listed; noise has many
DEAF_REPORTS = 2  # [-] successive reports without a packet


class Health:
    """Reports on ports, byte streams and nodes; rates are means since the previous report."""

    def __init__(
        self, pipeline: ImuPipeline, sources: Sequence[SerialSource], ports: Sequence[PortConfig]
    ) -> None:
        self._pipeline = pipeline
        self._sources = sources
        self._ports = ports
        self._then_ns = 0
        self._samples = [0] * len(pipeline.nodes)
        self._implausible = [0] * len(pipeline.nodes)
        self._received = [(0, 0)] * len(ports)  # bytes and frames
        self._deaf_reports = [0] * len(ports)

    def report(self, now_ns: int) -> Report:
        """The state at this host time [ns]."""
        pipeline = self._pipeline
        elapsed_s = (now_ns - self._then_ns) * 1e-9 if self._then_ns else math.inf
        self._then_ns = now_ns
        values: dict[str, object] = {}
        complaints = []
        for i, source in enumerate(self._sources):
            prefix = f"{source.name}." if len(self._sources) > 1 else ""
            values[f"{prefix}port"] = source.state.value
            values |= source.counters.as_dict(prefix) | pipeline.parsers[i].counters.as_dict(prefix)
            complaint = self._port_complaint(i)
            if complaint is not None:
                complaints.append(complaint)
        values["unknown_nodes"] = self._unknown_nodes()
        silent, implausible = [], []
        for i, (node, state) in enumerate(zip(pipeline.nodes, pipeline.states, strict=True)):
            rate = (state.samples - self._samples[i]) / elapsed_s
            if state.samples == self._samples[i]:
                silent.append(node.segment)
            self._samples[i] = state.samples
            if state.implausible > self._implausible[i]:
                implausible.append(node.segment)
            self._implausible[i] = state.implausible
            values.update(self._node_values(i, node, state, rate))
        if implausible:
            text = f"implausible samples from {', '.join(implausible)}: are the units right?"
            complaints.append((Level.WARN, text))
        if not complaints:
            complaints.append(_summary(silent, len(pipeline.nodes)))
        level = max(level for level, _ in complaints)
        message = "; ".join(text for _, text in complaints)
        return Report(level=level, message=message, values=values)

    def _port_complaint(self, i: int) -> tuple[Level, str] | None:
        """Level and message of a port's fault; None without one."""
        source, config = self._sources[i], self._ports[i]
        which = f"{source.name}: " if len(self._sources) > 1 else ""
        bytes_, frames = source.counters["bytes"], self._pipeline.parsers[i].counters["frames"]
        bytes_before, frames_before = self._received[i]
        self._received[i] = (bytes_, frames)
        deaf = bytes_ - bytes_before >= DEAF_BYTES and frames == frames_before
        self._deaf_reports[i] = self._deaf_reports[i] + 1 if deaf else 0
        if source.state is PortState.LOST:
            return Level.ERROR, f"{which}the port was lost: trying to reopen it"
        if source.state is not PortState.OPEN:
            return Level.WARN, f"{which}port: {source.state.value}"
        if self._deaf_reports[i] < DEAF_REPORTS:
            return None
        others = [str(b) for b in PROTOCOLS[config.protocol].baudrates if b != config.baudrate]
        return Level.ERROR, (
            f"{which}{bytes_} bytes have arrived, but no valid {config.protocol} packet lately: "
            f"is the baud rate {config.baudrate} right? try {', '.join(others)}; "
            "or is it another protocol?"
        )

    def _unknown_nodes(self) -> str:
        """Counts by node id, as text."""
        several = len(self._sources) > 1
        unknown = self._pipeline.unknown_nodes
        counts = [
            f"{self._sources[port].name} {node_id}: {n}" if several else f"{node_id}: {n}"
            for (port, node_id), n in sorted(unknown.most_common(UNKNOWN_NAMED))
        ]
        more = len(unknown) - UNKNOWN_NAMED
        return ", ".join(counts) + (f" and {more} more" if more > 0 else "") or "none"

    def _node_values(
        self, i: int, node: ImuNode, state: NodeState, rate: float
    ) -> dict[str, object]:
        filter_ = self._pipeline.filter
        values: dict[str, object] = {
            "node_id": node.node_id,
            "rate_hz": f"{rate:.1f}",
            **state.sequence.counters.as_dict(),
            **state.clock.counters.as_dict(),
            "clock_drift_ppm": f"{1e6 * state.clock.drift:.1f}",
            "gaps": state.gaps,
            "saturated": state.saturated,
            "implausible": state.implausible,
            "gyro_rests": filter_.rests[i],
            "gyro_bias_rad_s": " ".join(f"{component:.4f}" for component in filter_.bias[i]),
            "magnetometer_rejected": filter_.rejected[i],
            "heading_stddev_deg": f"{np.degrees(filter_.heading_stddev[i]):.1f}",
        }
        return {f"{node.segment}.{name}": value for name, value in values.items()}


def _summary(silent: list[str], count: int) -> tuple[Level, str]:
    if len(silent) == count:
        return Level.WARN, "no node sends: are the nodes switched on?"
    if silent:
        return Level.WARN, f"silent nodes: {', '.join(silent)}"
    return Level.OK, f"{count} nodes"
