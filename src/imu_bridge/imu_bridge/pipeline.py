"""From received bytes to stamped, calibrated, oriented samples."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from imu_bridge.filters.madgwick import MadgwickFilter
from imu_bridge.gyro_bias import RestBiasEstimator
from imu_bridge.node_clock import NodeClock
from imu_bridge.protocols.star import FULL_SCALE_COUNTS, Decoder, RawSample, to_si
from imu_bridge.segments import ImuNode
from imu_bridge.sequence import Arrival, SequenceTracker

FloatArray = NDArray[np.float64]
IndexArray = NDArray[np.intp]


@dataclass(frozen=True, kw_only=True, slots=True)
class Chunk:
    """Bytes as they came from the port.

    Attributes:
        arrival_ns: Host time at which the last of them had arrived [ns].
        data: The bytes; empty where the stream was cut, because the port went away.
    """

    arrival_ns: int
    data: bytes


@dataclass(frozen=True, kw_only=True)
class ImuBatch:
    """n samples of any nodes, in order of arrival; a node's own samples in order of time.

    Attributes:
        node: Index into the nodes of the nodes file, shape (n,).
        stamp_ns: When each was taken, host time [ns].
        raw_angular_velocity: As measured [rad/s], shape (n, 3).
        raw_acceleration: As measured [m/s^2], shape (n, 3).
        raw_magnetic_field: As measured [T], shape (n, 3); NaN where there is no new one.
        angular_velocity: Calibrated, bias removed [rad/s], shape (n, 3).
        acceleration: Calibrated [m/s^2], shape (n, 3).
        orientation: ``R_world_sensor`` as (x, y, z, w), world ENU or, where ``has_heading`` is
            false, z up with an arbitrary heading; shape (n, 4); NaN before the first.
        has_heading: Whether the heading is known, shape (n,).
    """

    node: IndexArray
    stamp_ns: Sequence[int]
    raw_angular_velocity: FloatArray
    raw_acceleration: FloatArray
    raw_magnetic_field: FloatArray
    angular_velocity: FloatArray
    acceleration: FloatArray
    orientation: FloatArray
    has_heading: NDArray[np.bool_]

    def __len__(self) -> int:
        """The number of samples."""
        return len(self.stamp_ns)


class NodeState:
    """What is known of one node's stream.

    Attributes:
        sequence: Counts of its frames.
        clock: Its mapping to host time.
        samples: Samples that went through the filter.
        saturated: Those of them with an accelerometer or gyroscope axis at full scale.
        gaps: Times its orientation began anew because samples were missing for too long.
    """

    def __init__(self, max_drift: float) -> None:
        self.sequence = SequenceTracker()
        self.clock = NodeClock(max_drift)
        self.samples = 0
        self.saturated = 0
        self.gaps = 0


class ImuPipeline:
    """Decodes, stamps, calibrates and filters the samples of all nodes on a port.

    Args:
        nodes: The nodes to expect; frames of others are counted by id and dropped.
        beta: Gain of Madgwick's filter [rad/s].
        bias_window_s: Window of the rest detection for the gyroscopes' bias [s]; 0: none.
        max_gap_s: After a longer gap a node's orientation begins anew [s].
        max_drift: Largest relative drift of a node's clock [s/s].
        transport_delay_s: Least delay from sampling to arrival, taken off the stamps [s].

    Attributes:
        decoder: With the counts of the byte stream.
        states: Of each node, in the order of ``nodes``.
        unknown_nodes: Frames by node id that the nodes file does not name.
    """

    def __init__(
        self,
        nodes: Sequence[ImuNode],
        *,
        beta: float = 0.1,
        bias_window_s: float = 2.0,
        max_gap_s: float = 1.0,
        max_drift: float = 100e-6,
        transport_delay_s: float = 0.0,
    ) -> None:
        self.nodes = tuple(nodes)
        self.decoder = Decoder()
        self.states = [NodeState(max_drift) for _ in self.nodes]
        self.unknown_nodes: dict[int, int] = {}
        self.bias = RestBiasEstimator(len(self.nodes), bias_window_s)
        self.filter = MadgwickFilter(len(self.nodes), beta)
        self._index = {node.node_id: i for i, node in enumerate(self.nodes)}
        self._max_gap_s = max_gap_s
        self._transport_delay_ns = round(transport_delay_s * 1e9)
        self._gyroscope_bias = np.array([n.gyroscope_bias for n in self.nodes])
        self._accelerometer_offset = np.array([n.accelerometer.offset for n in self.nodes])
        self._accelerometer_matrix = np.array([n.accelerometer.matrix for n in self.nodes])
        self._magnetometer_offset = np.array([n.magnetometer.offset for n in self.nodes])
        self._magnetometer_matrix = np.array([n.magnetometer.matrix for n in self.nodes])

    def process(self, chunks: Sequence[Chunk]) -> ImuBatch:
        """Everything that these chunks, in order of arrival, complete."""
        samples: list[RawSample] = []
        node: list[int] = []
        stamp_ns: list[int] = []
        dt: list[float] = []  # [s], NaN where the node begins anew
        # In sequence by nature: each frame is judged by those of its node before it.
        for chunk in chunks:
            received = self.decoder.feed(chunk.data) if chunk.data else self.decoder.flush()
            for sample in received:
                i = self._index.get(sample.node_id)
                if i is None:
                    count = self.unknown_nodes.get(sample.node_id, 0)
                    self.unknown_nodes[sample.node_id] = count + 1
                    continue
                state = self.states[i]
                arrival = state.sequence.classify(sample.sequence, sample.clock_us)
                if arrival in (Arrival.DUPLICATE, Arrival.LATE):
                    continue
                time = state.clock.stamp(sample.clock_us, chunk.arrival_ns)
                elapsed_s = None if arrival is Arrival.RESTART else time.elapsed_s
                samples.append(sample)
                node.append(i)
                stamp_ns.append(time.stamp_ns - self._transport_delay_ns)
                dt.append(np.nan if elapsed_s is None else elapsed_s)
        return self._filtered(samples, np.array(node, dtype=np.intp), stamp_ns, np.array(dt))

    def _filtered(
        self, samples: list[RawSample], node: IndexArray, stamp_ns: list[int], dt: FloatArray
    ) -> ImuBatch:
        raw = to_si(samples)
        rate = raw.angular_velocity - self._gyroscope_bias[node]
        acceleration = _calibrated(
            raw.acceleration, self._accelerometer_offset[node], self._accelerometer_matrix[node]
        )
        field = _calibrated(
            raw.magnetic_field, self._magnetometer_offset[node], self._magnetometer_matrix[node]
        )
        self._count(samples, node)
        orientation = np.empty((len(samples), 4))
        has_heading = np.empty(len(samples), dtype=bool)
        for rows in _rounds(node):
            index = node[rows]
            step_s = self._steps(index, dt[rows])
            self.bias.update(index, step_s, rate[rows], acceleration[rows])
            rate[rows] -= self.bias.bias[index]
            orientation[rows] = self.filter.update(
                index, step_s, rate[rows], acceleration[rows], field[rows]
            )
            has_heading[rows] = self.filter.has_heading[index]
        return ImuBatch(
            node=node,
            stamp_ns=stamp_ns,
            raw_angular_velocity=raw.angular_velocity,
            raw_acceleration=raw.acceleration,
            raw_magnetic_field=raw.magnetic_field,
            angular_velocity=rate,
            acceleration=acceleration,
            orientation=orientation,
            has_heading=has_heading,
        )

    def _steps(self, index: IndexArray, dt: FloatArray) -> FloatArray:
        """Time steps [s]; nodes that begin anew are reset and get 0."""
        anew = ~(dt <= self._max_gap_s)
        if not anew.any():
            return dt
        for i, step_s in zip(index[anew].tolist(), dt[anew].tolist(), strict=True):
            self.states[i].gaps += not np.isnan(step_s)
            self.filter.reset(i)
            self.bias.restart(i)
        return np.where(anew, 0.0, dt)

    def _count(self, samples: list[RawSample], node: IndexArray) -> None:
        full = (-FULL_SCALE_COUNTS, FULL_SCALE_COUNTS - 1)
        for i, sample in zip(node.tolist(), samples, strict=True):
            state = self.states[i]
            state.samples += 1
            inertial = (*sample.accelerometer, *sample.gyroscope)
            state.saturated += min(inertial) == full[0] or max(inertial) == full[1]


def _calibrated(measured: FloatArray, offset: FloatArray, matrix: FloatArray) -> FloatArray:
    """``matrix @ (measured - offset)`` for each of n samples."""
    return np.matmul(matrix, (measured - offset)[:, :, None])[:, :, 0]


def _rounds(node: IndexArray) -> list[IndexArray]:
    """Rows grouped so that a node occurs at most once a group, its samples in order."""
    seen: dict[int, int] = {}
    rounds: list[list[int]] = []
    for row, i in enumerate(node.tolist()):
        turn = seen.get(i, 0)
        seen[i] = turn + 1
        if turn == len(rounds):
            rounds.append([])
        rounds[turn].append(row)
    return [np.array(rows, dtype=np.intp) for rows in rounds]
