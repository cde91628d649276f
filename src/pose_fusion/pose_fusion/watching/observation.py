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


@dataclass(frozen=True, kw_only=True)
class TopicStatus:
    """One topic, lately."""

    name: str
    rate: float  # [Hz]
    age_s: float | None  # [s] since the last message; None: there was none
    latency_s: float | None  # [s] median from a message's stamp to its arrival here


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
    """Counts one topic's messages."""

    def __init__(self, name: str) -> None:
        self.name = name
        self._arrivals: deque[tuple[int, float]] = deque()  # [ns], latency [s]
        self._last_ns: int | None = None

    def add(self, now_ns: int, stamp_ns: int | None) -> None:
        """Note a message that has just come, stamped with ``stamp_ns`` if it has a header."""
        latency_s = float("nan") if stamp_ns is None else (now_ns - stamp_ns) / NS_PER_S
        self._arrivals.append((now_ns, latency_s))
        self._last_ns = now_ns
        self._forget(now_ns)

    def status(self, now_ns: int) -> TopicStatus:
        """The topic's state now."""
        self._forget(now_ns)
        latencies = np.array([latency for _, latency in self._arrivals])
        latencies = latencies[np.isfinite(latencies)]
        age_s = None if self._last_ns is None else (now_ns - self._last_ns) / NS_PER_S
        return TopicStatus(
            name=self.name,
            rate=self._rate(now_ns),
            age_s=age_s,
            latency_s=float(np.median(latencies)) if len(latencies) else None,
        )

    def _rate(self, now_ns: int) -> float:
        """Messages a second, over the window or since the first one."""
        if len(self._arrivals) < 2:
            return 0.0
        since_ns = max(now_ns - round(WINDOW_S * NS_PER_S), self._arrivals[0][0])
        span_s = (now_ns - since_ns) / NS_PER_S
        return (len(self._arrivals) - 1) / span_s if span_s > 0.0 else 0.0

    def _forget(self, now_ns: int) -> None:
        while self._arrivals and now_ns - self._arrivals[0][0] > WINDOW_S * NS_PER_S:
            self._arrivals.popleft()


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
