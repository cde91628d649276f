"""Pipeline from received bytes to samples with stamp, calibration and orientation."""

from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from imu_bridge.filters import FILTERS
from imu_bridge.filters.orientation_filter import IndexArray, SampleRound
from imu_bridge.node_clock import CountingClock, NodeClock, NodeTime
from imu_bridge.parameters import ImuBridgeParameters
from imu_bridge.protocols.reading import Parser, Reading, is_plausible
from imu_bridge.protocols.star import StarParser
from imu_bridge.segments import ImuNode, Linear
from imu_bridge.sequence import Arrival, SequenceTracker
from pose_core.arrays import FloatArray

NO_VECTOR = (np.nan,) * 3
NO_QUATERNION = (np.nan,) * 4
DEFAULTS = ImuBridgeParameters()


@dataclass(frozen=True, kw_only=True, slots=True)
class Chunk:
    """Bytes received from a port."""

    arrival_ns: int  # [ns] of the last byte, on the host's clock
    data: bytes  # empty where the stream was interrupted because the port was lost
    port: int = 0  # index of the port


@dataclass(frozen=True, kw_only=True)
class ImuBatch:
    """n samples of any nodes, in order of arrival; a node's own samples in order of time."""

    node: IndexArray  # (n,) index into the nodes of the nodes file
    stamp_ns: Sequence[int]  # n times of sampling [ns] on the host's clock
    raw_angular_velocity: FloatArray  # (n, 3) [rad/s] as measured
    raw_acceleration: FloatArray  # (n, 3) [m/s^2] as measured
    raw_magnetic_field: FloatArray  # (n, 3) [T] as measured; NaN where there is no new one
    angular_velocity: FloatArray  # (n, 3) [rad/s] calibrated, bias removed
    acceleration: FloatArray  # (n, 3) [m/s^2] calibrated
    orientation: FloatArray
    """``R_world_sensor`` as (x, y, z, w), (n, 4), NaN before the first; the world is ENU, or z up
    with an arbitrary heading if it is unknown."""
    heading_stddev: FloatArray  # (n,) [rad]; pi where the heading is unknown

    def __len__(self) -> int:
        """The number of samples."""
        return len(self.stamp_ns)


@dataclass(kw_only=True)
class NodeState:
    """State of one node's stream."""

    sequence: SequenceTracker
    clock: NodeClock | CountingClock  # maps its clock to host time
    samples: int = 0  # filtered
    saturated: int = 0  # of these, with an accelerometer or gyroscope axis at full scale
    implausible: int = 0  # samples outside any sensor's range; they are left out
    gaps: int = 0  # resets of its orientation after a gap

    def stamp(self, clock_us: int | None, arrival_ns: int) -> NodeTime:
        """The host time of an accepted sample."""
        if clock_us is not None and isinstance(self.clock, NodeClock):
            return self.clock.stamp(clock_us, arrival_ns)
        if isinstance(self.clock, NodeClock):
            self.clock = CountingClock()  # the device has no clock
        return self.clock.stamp(arrival_ns)


class ImuPipeline:
    """Decodes, stamps, calibrates and filters the samples of all nodes on all ports.

    Args:
        nodes: The nodes to expect; frames of others are counted by id and dropped.
        parameters: Those of the node ``imu_bridge``.
        parsers: Parser of each port; by default one star network.

    Attributes:
        parsers: Parsers, with the counters of the byte streams.
        states: State of each node, in the order of ``nodes``.
        filter: The filter, with the estimates of biases and headings.
        unknown_nodes: Number of frames by port and node id missing in the nodes file.
    """

    def __init__(
        self,
        nodes: Sequence[ImuNode],
        parameters: ImuBridgeParameters = DEFAULTS,
        parsers: Sequence[Parser] | None = None,
    ) -> None:
        self.nodes = tuple(nodes)
        self.parsers = (StarParser(),) if parsers is None else tuple(parsers)
        moduli_us = [self.parsers[node.port].clock_modulus_us for node in self.nodes]
        self.states = [
            NodeState(
                sequence=SequenceTracker(modulus_us),
                clock=NodeClock(parameters.max_clock_drift, modulus_us),
            )
            for modulus_us in moduli_us
        ]
        self.unknown_nodes: Counter[tuple[int, int]] = Counter()
        self.filter = FILTERS[parameters.filter](len(self.nodes), parameters)
        self._index = {(node.port, node.node_id): i for i, node in enumerate(self.nodes)}
        self._max_gap_s = parameters.max_gap
        self._transport_delay_ns = round(parameters.transport_delay * 1e9)
        self._gyroscope_bias = np.array([n.gyroscope_bias for n in self.nodes])
        self._accelerometers = _stacked([n.accelerometer for n in self.nodes])
        self._magnetometers = _stacked([n.magnetometer for n in self.nodes])

    def process(self, chunks: Sequence[Chunk]) -> ImuBatch:
        """Process chunks, in order of arrival at each port; returns all complete samples."""
        readings: list[Reading] = []
        node: list[int] = []
        stamp_ns: list[int] = []
        dt: list[float] = []  # [s], NaN where a node restarts
        # Sequential: each frame is classified by the node's previous frames.
        for chunk in chunks:
            parser = self.parsers[chunk.port]
            for reading in parser.parse(chunk.data) if chunk.data else parser.finish():
                who = (chunk.port, reading.node_id)
                i = self._index.get(who)
                if i is None:
                    self.unknown_nodes[who] += 1
                    continue
                state = self.states[i]
                if not is_plausible(reading):
                    state.implausible += 1
                    continue
                arrival = state.sequence.classify(reading.sequence, reading.clock_us)
                if arrival in (Arrival.DUPLICATE, Arrival.LATE):
                    continue
                time = state.stamp(reading.clock_us, chunk.arrival_ns)
                elapsed_s = None if arrival is Arrival.RESTART else time.elapsed_s
                readings.append(reading)
                node.append(i)
                stamp_ns.append(time.stamp_ns - self._transport_delay_ns)
                dt.append(np.nan if elapsed_s is None else elapsed_s)
        return self._filtered(readings, np.array(node, dtype=np.intp), stamp_ns, np.array(dt))

    def _filtered(
        self, readings: list[Reading], node: IndexArray, stamp_ns: list[int], dt: FloatArray
    ) -> ImuBatch:
        raw_rate = _rows([r.angular_velocity for r in readings], 3)
        raw_acceleration = _rows([r.acceleration for r in readings], 3)
        raw_field = _rows([r.magnetic_field or NO_VECTOR for r in readings], 3)
        own = _rows([r.orientation or NO_QUATERNION for r in readings], 4)
        rate = raw_rate - self._gyroscope_bias[node]
        acceleration = _calibrated(raw_acceleration, self._accelerometers, node)
        field = _calibrated(raw_field, self._magnetometers, node)
        for i, reading in zip(node.tolist(), readings, strict=True):
            self.states[i].samples += 1
            self.states[i].saturated += reading.saturated
        orientation = np.empty((len(readings), 4))
        heading_stddev = np.empty(len(readings))
        for rows in _rounds(node):
            index = node[rows]
            samples = SampleRound(
                index=index,
                dt=self._steps(index, dt[rows]),
                angular_velocity=rate[rows],
                acceleration=acceleration[rows],
                magnetic_field=field[rows],
                device_orientation=own[rows],
            )
            orientation[rows] = self.filter.update(samples)
            rate[rows] -= self.filter.bias[index]
            heading_stddev[rows] = self.filter.heading_stddev[index]
        return ImuBatch(
            node=node,
            stamp_ns=stamp_ns,
            raw_angular_velocity=raw_rate,
            raw_acceleration=raw_acceleration,
            raw_magnetic_field=raw_field,
            angular_velocity=rate,
            acceleration=acceleration,
            orientation=orientation,
            heading_stddev=heading_stddev,
        )

    def _steps(self, index: IndexArray, dt: FloatArray) -> FloatArray:
        """Time steps [s]; restarting nodes are reset and get 0."""
        anew = ~(dt <= self._max_gap_s)
        if not anew.any():
            return dt
        for i, step_s in zip(index[anew].tolist(), dt[anew].tolist(), strict=True):
            self.states[i].gaps += not np.isnan(step_s)
            self.filter.reset(i)
        return np.where(anew, 0.0, dt)


def _rows(vectors: Sequence[Sequence[float]], width: int) -> FloatArray:
    """An array of shape (n, width), also for n = 0."""
    return np.array(vectors, dtype=float).reshape(-1, width)


def _stacked(sensors: Sequence[Linear]) -> Linear:
    """The calibrations of all nodes' sensors as one: offset (nodes, 3), matrix (nodes, 3, 3)."""
    return Linear(
        offset=np.array([s.offset for s in sensors]), matrix=np.array([s.matrix for s in sensors])
    )


def _calibrated(measured: FloatArray, sensors: Linear, node: IndexArray) -> FloatArray:
    """``matrix @ (measured - offset)`` for each of n samples, by the sensor of its node."""
    relative = (measured - sensors.offset[node])[:, :, None]
    return np.matmul(sensors.matrix[node], relative)[:, :, 0]


def _rounds(node: IndexArray) -> list[IndexArray]:
    """Groups of rows in which each node occurs at most once, its samples in order."""
    seen: Counter[int] = Counter()
    rounds = defaultdict(list)
    for row, i in enumerate(node.tolist()):
        rounds[seen[i]].append(row)
        seen[i] += 1
    return [np.array(rows, dtype=np.intp) for rows in rounds.values()]
