"""Stamps of live frames: on the host's clock, strictly increasing.

A capture time is one of three:

- on the host's clock, such as a ROS stamp of the same machine: it is the stamp;
- on another clock, such as a device's counter: it is mapped by the line below the arrivals
  (:mod:`pose_core.lower_line`), which removes the jitter of transport but not its minimum delay;
- missing: the stamp is the arrival minus the delay of the previous frame.
"""

from pose_core.counters import Counters
from pose_core.lower_line import LowerLine
from pose_core.stamps import NS_PER_S

MAX_DRIFT = 1e-3  # [s/s] between two clocks
JUMP_NS = 5 * NS_PER_S  # [ns] larger steps mean that a clock was set or restarted
AHEAD_NS = 50_000_000  # [ns] by which a stamp on the host's clock may be in the future
HOLD_NS = 1000  # [ns] step of a stamp that would otherwise decrease

CLOCK_COUNTERS = (
    "frames_repeated",  # left out: the capture time of the previous frame
    "frames_out_of_order",  # left out: an earlier capture time
    "clock_jumps",  # the capture clock was set or restarted; its mapping restarts
    "clock_steps",  # lasting changes of the offset between the clocks
    "stamps_missing",  # no capture time: stamped by arrival
    "stamps_mapped",  # capture on another clock than the host's, mapped
    "stamps_held",  # would otherwise have decreased
)


class LiveClock:
    """Stamps the frames of one source.

    Args:
        counters: Counters that contain :data:`CLOCK_COUNTERS`.
        on_host_clock: Whether capture times are on the host's clock, as long as plausible.
    """

    def __init__(self, counters: Counters, *, on_host_clock: bool) -> None:
        self._counters = counters
        self._on_host_clock = on_host_clock
        self._line = LowerLine(MAX_DRIFT)
        self._capture_ns: int | None = None
        self._arrival_ns = 0
        self._stamp_ns: int | None = None
        self.delay_ns = 0
        """Delay from stamp to arrival of the newest frame [ns]."""

    @property
    def drift(self) -> float:
        """Relative drift of the host's clock against the source's [s/s]; 0 if unknown."""
        return self._line.skew

    def stamp(self, capture_ns: int | None, arrival_ns: int) -> int | None:
        """The stamp of a frame [ns], or None if it must be left out (and has been counted).

        Args:
            capture_ns: Capture time on any clock [ns], or None.
            arrival_ns: Arrival on the host's clock [ns].
        """
        if capture_ns is None:
            self._counters.add("stamps_missing")
            return self._finish(arrival_ns - self.delay_ns, arrival_ns)
        if not self._goes_on(capture_ns, arrival_ns):
            return None
        self._capture_ns, self._arrival_ns = capture_ns, arrival_ns
        if self._on_host_clock and -AHEAD_NS <= arrival_ns - capture_ns <= JUMP_NS:
            return self._finish(capture_ns, arrival_ns)
        self._counters.add("stamps_mapped")
        if self._line.add(capture_ns, arrival_ns):
            self._counters.add("clock_steps")
        return self._finish(capture_ns + self._line.at(capture_ns), arrival_ns)

    def _goes_on(self, capture_ns: int, arrival_ns: int) -> bool:
        """Whether the frame is newer than the previous one; after a jump the mapping restarts."""
        if self._capture_ns is None:
            return True
        step_ns, passed_ns = capture_ns - self._capture_ns, arrival_ns - self._arrival_ns
        if abs(step_ns - passed_ns) > JUMP_NS or passed_ns < -JUMP_NS:
            self._counters.add("clock_jumps")
            self._line.restart()
            return True
        if step_ns <= 0:
            self._counters.add("frames_out_of_order" if step_ns else "frames_repeated")
        return step_ns > 0

    def _finish(self, stamp_ns: int, arrival_ns: int) -> int:
        # A larger step back means that the host's clock was set back: stamps continue from there.
        if self._stamp_ns is not None and -JUMP_NS <= stamp_ns - self._stamp_ns <= 0:
            self._counters.add("stamps_held")
            stamp_ns = self._stamp_ns + HOLD_NS
        self._stamp_ns, self.delay_ns = stamp_ns, max(0, arrival_ns - stamp_ns)
        return stamp_ns
