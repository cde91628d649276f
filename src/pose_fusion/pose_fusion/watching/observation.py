"""What is known of a running graph's topics and nodes, from the messages that have come lately."""

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pose_core.api import FloatArray
from pose_core.joints import JOINTS, TrackingState
from pose_core.stamps import NS_PER_S
from pose_node.node_status import NodeStatus

WINDOW_S = 5.0  # [s] what rates, latencies and shares are taken over
GAP_WINDOW_S = 60.0  # [s] over which gaps are counted
GAP_PERIODS = 2.5  # [median periods] shortest gap
MIN_GAP_S = 0.1  # [s]


@dataclass(frozen=True, kw_only=True)
class TopicStatus:
    """One topic, lately."""

    name: str
    rate: float  # [Hz]
    age_s: float | None  # [s] since the last message; None: there was none
    latency_s: float | None  # [s] median from a message's stamp to its arrival here
    gaps: int = 0  # [-] between stamps, in the last minute
    longest_gap_s: float = 0.0  # [s] of them
    publishers: int = 1


@dataclass(frozen=True, kw_only=True)
class GraphSnapshot:
    """A graph at one moment."""

    topics: tuple[TopicStatus, ...]  # by name
    nodes: tuple[str, ...]  # all that are there, ours or not
    statuses: tuple[NodeStatus, ...]  # of those that report
    tracked: Mapping[str, FloatArray]  # (15,) share of frames with the joint tracked, by topic
    placed_sensors: tuple[str, ...]  # Kinects whose place in map is known
    fusion_latency_s: tuple[float, float] | None  # [s] median and 99th percentile
    hears_itself: bool  # whether a message of our own has come back


class TopicWatch:
    """Watches the messages of one topic.

    Args:
        name: The topic's name.
        window_s: Time over which rate and latency are averaged [s].
    """

    def __init__(self, name: str, window_s: float = WINDOW_S) -> None:
        self.name = name
        self._window_ns = round(window_s * NS_PER_S)
        self._arrivals: deque[tuple[int, int | None]] = deque()  # [ns] arrival, stamp
        self._gaps: deque[tuple[int, float]] = deque()  # [ns] arrival, [s]

    def add(self, now_ns: int, stamp_ns: int | None) -> None:
        """Note a message that has just come, stamped with ``stamp_ns`` if it has a header."""
        last_ns = self._arrivals[-1][1] if self._arrivals else None
        if stamp_ns is not None and last_ns is not None:
            gap_s = (stamp_ns - last_ns) / NS_PER_S
            if gap_s > MIN_GAP_S and gap_s > GAP_PERIODS * self._period_s():
                self._gaps.append((now_ns, gap_s))
        self._arrivals.append((now_ns, stamp_ns))
        self._forget(now_ns)

    def status(self, now_ns: int) -> TopicStatus:
        """The topic's state now."""
        self._forget(now_ns)
        latencies_ns = [
            at_ns - stamp_ns
            for at_ns, stamp_ns in self._arrivals
            if stamp_ns is not None and now_ns - at_ns <= self._window_ns
        ]
        return TopicStatus(
            name=self.name,
            rate=self._rate(now_ns),
            age_s=(now_ns - self._arrivals[-1][0]) / NS_PER_S if self._arrivals else None,
            latency_s=float(np.median(latencies_ns)) / NS_PER_S if latencies_ns else None,
            gaps=len(self._gaps),
            longest_gap_s=max((gap_s for _, gap_s in self._gaps), default=0.0),
        )

    def _rate(self, now_ns: int) -> float:
        """Messages a second, over the window or since the first one."""
        if len(self._arrivals) < 2:
            return 0.0
        span_s = (now_ns - self._arrivals[0][0]) / NS_PER_S
        return (len(self._arrivals) - 1) / span_s if span_s > 0.0 else 0.0

    def _period_s(self) -> float:
        """Median time between two stamps [s]; 0 if it is unknown."""
        stamps_ns = [stamp_ns for _, stamp_ns in self._arrivals if stamp_ns is not None]
        return float(np.median(np.diff(stamps_ns))) / NS_PER_S if len(stamps_ns) > 2 else 0.0

    def _forget(self, now_ns: int) -> None:
        """Drop old arrivals and gaps; the last arrival is kept."""
        while len(self._arrivals) > 1 and now_ns - self._arrivals[0][0] > self._window_ns:
            self._arrivals.popleft()
        while self._gaps and now_ns - self._gaps[0][0] > GAP_WINDOW_S * NS_PER_S:
            self._gaps.popleft()


class TrackingWatch:
    """The share of frames in which each of the 15 joints was tracked."""

    def __init__(self) -> None:
        self._frames: deque[tuple[int, NDArray[np.bool_]]] = deque()

    def add(self, now_ns: int, tracking_state: NDArray[np.uint8]) -> None:
        """Note a person's states, shape (15,)."""
        self._frames.append((now_ns, np.asarray(tracking_state == TrackingState.TRACKED)))
        self._forget(now_ns)

    def share(self, now_ns: int) -> FloatArray:
        """Shape (15,), 0 to 1; NaN if there was no frame."""
        self._forget(now_ns)
        if not self._frames:
            return np.full(len(JOINTS), np.nan)
        return np.mean([tracked for _, tracked in self._frames], axis=0, dtype=float)

    def _forget(self, now_ns: int) -> None:
        while self._frames and now_ns - self._frames[0][0] > WINDOW_S * NS_PER_S:
            self._frames.popleft()
