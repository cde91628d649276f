"""Monitoring of a stream: rate, delay, gaps."""

from collections import deque
from dataclasses import dataclass

import numpy as np

from pose_core.stamps import NS_PER_S

RATE_SPAN_S = 2.0  # [s] over which rate and delay are averaged
GAP_SPAN_S = 60.0  # [s] over which gaps are counted
GAP_PERIODS = 2.5  # [median periods] shortest gap
SHORTEST_GAP_S = 0.1  # [s]
SILENT_AFTER_S = 1.0  # [s]


@dataclass(frozen=True, kw_only=True)
class StreamReading:
    """Current state of a stream."""

    rate_hz: float  # [Hz]
    delay_s: float | None  # [s] median from stamp to arrival
    gaps: int  # [-] in the last minute
    longest_gap_s: float  # [s] of them
    silent_s: float  # [s] since the last message


class StreamMonitor:
    """Monitors the stamps of one topic."""

    def __init__(self) -> None:
        self._arrivals: deque[tuple[int, int]] = deque()  # [ns] arrival, stamp
        self._gaps: deque[tuple[int, float]] = deque()  # [ns] arrival, [s]

    def add(self, stamp_ns: int, now_ns: int) -> None:
        """Add the arrival of a message."""
        if self._arrivals:
            gap_s = (stamp_ns - self._arrivals[-1][1]) / NS_PER_S
            if gap_s > SHORTEST_GAP_S and gap_s > GAP_PERIODS * self._period_s():
                self._gaps.append((now_ns, gap_s))
        self._arrivals.append((now_ns, stamp_ns))
        self._forget(now_ns)

    def reading(self, now_ns: int) -> StreamReading | None:
        """The stream's state, None before the first message."""
        if not self._arrivals:
            return None
        last_ns = self._arrivals[-1][0]
        self._forget(now_ns)
        recent = [a for a in self._arrivals if now_ns - a[0] <= RATE_SPAN_S * NS_PER_S]
        span_s = (recent[-1][1] - recent[0][1]) / NS_PER_S if len(recent) > 1 else 0.0
        delays = [(arrival - stamp) / NS_PER_S for arrival, stamp in recent]
        return StreamReading(
            rate_hz=(len(recent) - 1) / span_s if span_s > 0.0 else 0.0,
            delay_s=float(np.median(delays)) if delays else None,
            gaps=len(self._gaps),
            longest_gap_s=max((gap for _, gap in self._gaps), default=0.0),
            silent_s=(now_ns - last_ns) / NS_PER_S,
        )

    def _period_s(self) -> float:
        stamps = [stamp for _, stamp in self._arrivals]
        return float(np.median(np.diff(stamps))) / NS_PER_S if len(stamps) > 2 else 0.0

    def _forget(self, now_ns: int) -> None:
        """Drop old arrivals and gaps; the last arrival is kept."""
        while len(self._arrivals) > 1 and now_ns - self._arrivals[0][0] > RATE_SPAN_S * NS_PER_S:
            self._arrivals.popleft()
        while self._gaps and now_ns - self._gaps[0][0] > GAP_SPAN_S * NS_PER_S:
            self._gaps.popleft()
