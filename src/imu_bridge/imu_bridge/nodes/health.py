"""What the node says of itself in ``/diagnostics``."""

import math

from imu_bridge.pipeline import ImuPipeline, NodeState
from imu_bridge.segments import ImuNode
from imu_bridge.serial_source import PortState, SerialSource
from pose_common.nodes.diagnostics import Level, Report


class Health:
    """Sums up port, byte stream and nodes; rates are means since the report before."""

    def __init__(self, pipeline: ImuPipeline, source: SerialSource) -> None:
        self._pipeline = pipeline
        self._source = source
        self._then_ns = 0
        self._samples = [0] * len(pipeline.nodes)

    def report(self, now_ns: int) -> Report:
        """The state now, at this host time [ns]."""
        pipeline, source = self._pipeline, self._source
        elapsed_s = (now_ns - self._then_ns) * 1e-9 if self._then_ns else math.inf
        self._then_ns = now_ns
        values: dict[str, object] = {
            "port": source.state.value,
            **source.counters.as_dict(),
            **pipeline.decoder.counters.as_dict(),
            "unknown_nodes": _listed(pipeline.unknown_nodes),
        }
        silent = []
        for i, (node, state) in enumerate(zip(pipeline.nodes, pipeline.states, strict=True)):
            rate = (state.samples - self._samples[i]) / elapsed_s
            if state.samples == self._samples[i]:
                silent.append(node.segment)
            self._samples[i] = state.samples
            values.update(self._node_values(i, node, state, rate))
        level, message = _summary(source.state, silent, len(pipeline.nodes))
        return Report(level=level, message=message, values=values)

    def _node_values(
        self, i: int, node: ImuNode, state: NodeState, rate: float
    ) -> dict[str, object]:
        pipeline = self._pipeline
        bias = pipeline.bias.bias[i]
        values: dict[str, object] = {
            "node_id": node.node_id,
            "rate_hz": f"{rate:.1f}",
            **state.sequence.counters.as_dict(),
            **state.clock.counters.as_dict(),
            "gaps": state.gaps,
            "saturated": state.saturated,
            "gyro_rests": pipeline.bias.rests[i],
            "gyro_bias_rad_s": " ".join(f"{component:.4f}" for component in bias),
            "has_heading": bool(pipeline.filter.has_heading[i]),
        }
        return {f"{node.segment}.{name}": value for name, value in values.items()}


def _summary(state: PortState, silent: list[str], count: int) -> tuple[Level, str]:
    if state is PortState.LOST:
        return Level.ERROR, "the port was lost: trying to reopen it"
    if state is not PortState.OPEN:
        return Level.WARN, f"port: {state.value}"
    if len(silent) == count:
        return Level.WARN, "no node sends: are the nodes switched on, is the baud rate right?"
    if silent:
        return Level.WARN, f"silent nodes: {', '.join(silent)}"
    return Level.OK, f"{count} nodes"


def _listed(counts: dict[int, int]) -> str:
    """Counts by node id, for people."""
    return ", ".join(f"{node_id}: {n}" for node_id, n in sorted(counts.items())) or "none"
