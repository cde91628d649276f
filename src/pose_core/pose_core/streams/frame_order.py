"""Ordering of several sensors' frames by their stamps, with minimal delay.

Sensors with the same phase deliver their frames within a millisecond, in varying order. The median
period of each sensor and its variation predict whether an earlier frame of it is still due. Only
then does a frame wait.
"""

from collections import deque
from dataclasses import dataclass, field
from heapq import heappop, heappush
from math import inf
from statistics import median
from typing import Generic, TypeVar

from pose_core.stamps import JUMP_BACK_NS, newest_of

T = TypeVar("T")

REMEMBERED = 9  # [frames] over which the median period is taken
GIVEN_UP_NS = 200_000_000  # [ns] overdue, from which on no frame is waited for
MIN_JITTER_NS = 500_000  # [ns] lower bound of the jitter that is allowed for
MAX_JITTER_NS = 5_000_000  # [ns] upper bound of the jitter that is allowed for
JITTERS = 3.0  # [-] allowed jitter, in median deviations


@dataclass
class FramePeriod:
    """Predicts a sensor's next frame from its stamps."""

    newest_ns: int
    period_ns: float = 0.0  # median
    intervals_ns: deque[int] = field(default_factory=lambda: deque(maxlen=REMEMBERED))
    earliest_ns: float = inf  # [ns] after the newest frame, the earliest time of the next one

    def add(self, stamp_ns: int) -> None:
        """Note a frame."""
        self.intervals_ns.append(stamp_ns - self.newest_ns)
        self.newest_ns = stamp_ns
        self.period_ns = median(self.intervals_ns)
        deviation_ns = median(abs(each - self.period_ns) for each in self.intervals_ns)
        early_ns = min(max(JITTERS * deviation_ns, MIN_JITTER_NS), MAX_JITTER_NS)
        self.earliest_ns = self.period_ns - early_ns

    def expects_before(self, stamp_ns: int) -> bool:
        """Whether a frame with a stamp before an instant is still due."""
        missing_ns = stamp_ns - self.newest_ns
        return missing_ns > self.earliest_ns and not self.is_silent_at(stamp_ns)

    def is_silent_at(self, stamp_ns: int) -> bool:
        """Whether no frame is waited for any more, once others have this stamp."""
        return stamp_ns - self.newest_ns > self.period_ns + GIVEN_UP_NS


class FrameOrder(Generic[T]):
    """Holds a frame while an earlier frame of another sensor is due.

    Of a recording, a frame waits until every sensor that is not silent has passed its instant, also
    one whose corrected stamps are far behind. Live, a sensor's next frame releases those before it,
    and a caller that cannot wait as long calls :meth:`flush`.

    Args:
        is_live: Whether frames are processed as they come.
    """

    def __init__(self, *, is_live: bool = True) -> None:
        self._is_live = is_live
        self._newest_ns = 0  # stamp of the newest frame of any sensor
        self._periods: dict[str, FramePeriod] = {}
        # A heap by stamp, then by arrival; with each frame, whether it is a sensor's.
        self._held: list[tuple[int, int, T, bool]] = []
        self._count = 0
        self._released_ns: int | None = None

    @property
    def holds(self) -> bool:
        """Whether a frame is waiting."""
        return bool(self._held)

    def add(self, sensor: str, stamp_ns: int, frame: T) -> list[T]:
        """Add a frame; return the frames to process now, in the order of their stamps.

        A frame that arrives later than the others have waited for passes at once.
        """
        ready = []
        period = self._periods.get(sensor)
        if period is not None and stamp_ns < period.newest_ns - JUMP_BACK_NS:
            ready = self.flush()
            self._periods.clear()
            self._released_ns = period = None
        self._newest_ns = newest_of(self._newest_ns, stamp_ns)
        if period is None:
            self._periods[sensor] = FramePeriod(stamp_ns)
        elif stamp_ns > period.newest_ns:
            while self._is_live and self._held and self._held[0][0] <= period.newest_ns:
                ready.append(self._pop())
            period.add(stamp_ns)
        if self._released_ns is not None and stamp_ns < self._released_ns:
            return [*ready, frame]
        return ready + self._hold(stamp_ns, frame, is_sensors=True)

    def insert(self, stamp_ns: int, frame: T) -> list[T]:
        """Add a frame of no sensor; it waits as the others do, and none waits for it."""
        self._newest_ns = newest_of(self._newest_ns, stamp_ns)
        return self._hold(stamp_ns, frame, is_sensors=False)

    def _hold(self, stamp_ns: int, frame: T, *, is_sensors: bool) -> list[T]:
        """Hold a frame; return those that need not wait."""
        self._count += 1
        heappush(self._held, (stamp_ns, self._count, frame, is_sensors))
        ready = []
        while self._held and not any(
            period.expects_before(self._held[0][0])
            for period in self._periods.values()
            if not period.is_silent_at(self._newest_ns)
        ):
            ready.append(self._pop())
        return ready

    def flush(self) -> list[T]:
        """Return all held frames."""
        return [self._pop() for _ in range(len(self._held))]

    def _pop(self) -> T:
        stamp_ns, _, frame, is_sensors = heappop(self._held)
        if is_sensors:
            self._released_ns = stamp_ns
        return frame
