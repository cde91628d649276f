r"""Mapping of a node's clock to the host's, without the jitter of radio, USB and scheduler.

The stamp is the line below the arrivals (:mod:`pose_core.lower_line`) at the sample's node time:
as regular as the node's clock, never after the arrival, and late by the link's minimum delay.
"""

from typing import NamedTuple

from imu_bridge.sequence import signed
from pose_core.counters import Counters
from pose_core.lower_line import LowerLine
from pose_core.stamps import NS_PER_S, NS_PER_US

JUMP_NS = 5 * NS_PER_S  # [ns] difference from which on a clock has jumped: it restarted, or was set
HOLD_NS = 1000  # [ns] step of a stamp that would otherwise decrease
COUNTED_SKEW = 0.2  # [-] relative error of a period estimated from a few arrivals
COUNTED_STEP = 0.8  # [-] smallest delay, in periods, that indicates lost samples
COUNTED_STEP_NS = 8_000_000  # [ns] and the smallest delay in time, above that of a busy link
FIRST_SAMPLES = 20  # [-] required for the first estimate of the period
FIRST_NS = 250_000_000  # [ns] and their duration: drivers deliver several samples at once
PAUSE_NS = 2 * NS_PER_S  # [ns] after a longer silence the number of lost samples is unknown


class NodeTime(NamedTuple):
    """Time of a sample."""

    stamp_ns: int  # [ns] on the host's clock
    elapsed_s: float | None  # [s] since that; None for the first sample, and after a clock's jump


class _StampedSamples:
    """Stamps of one node's samples, strictly increasing until the host's clock is set back by far.

    Attributes:
        counters: ``clock_jumps``: of the node's clock; ``clock_steps``: lasting changes of the
            offset between the clocks, as when the host's is set; ``stamps_held``: stamps that
            would have decreased, because the line dropped by more than a sampling period.
    """

    def __init__(self) -> None:
        self.counters = Counters("clock_jumps", "clock_steps", "stamps_held")
        self._arrival_ns = 0
        self._stamp_ns = 0

    def _increasing(self, stamp_ns: int) -> int:
        """The stamp of the next sample [ns]: this one, unless it is not after the previous one.

        A larger step back means that the host's clock was set back: stamps continue from there.
        """
        if -JUMP_NS <= stamp_ns - self._stamp_ns <= 0:
            self.counters.add("stamps_held")
            stamp_ns = self._stamp_ns + HOLD_NS
        self._stamp_ns = stamp_ns
        return stamp_ns


class NodeClock(_StampedSamples):
    """Maps the wrapping clock of one node to host time.

    Args:
        max_drift: Largest relative drift between the two clocks [s/s].
        modulus_us: Modulus of the node's clock [us].
    """

    def __init__(self, max_drift: float = 1e-3, modulus_us: int = 1 << 32) -> None:
        super().__init__()
        self._line = LowerLine(max_drift)
        self._modulus_us = modulus_us
        self._clock_us = 0
        self._node_ns = 0  # unwrapped

    @property
    def drift(self) -> float:
        """Relative drift of the host's clock against the node's [s/s]."""
        return self._line.skew

    def stamp(self, clock_us: int, arrival_ns: int) -> NodeTime:
        """The host time of a sample.

        Args:
            clock_us: Node clock in the frame [us], modulo ``modulus_us``.
            arrival_ns: Host time at which the frame arrived [ns].
        """
        elapsed_ns = None
        if not self._line.is_empty:
            elapsed_ns = self._elapsed_ns(clock_us, arrival_ns)
            if elapsed_ns is None:
                self.counters.add("clock_jumps")
                self._line.restart()
        self._clock_us, self._arrival_ns = clock_us, arrival_ns
        self._node_ns = clock_us * NS_PER_US if elapsed_ns is None else self._node_ns + elapsed_ns
        if self._line.add(self._node_ns, arrival_ns):
            self.counters.add("clock_steps")
        stamp_ns = self._increasing(self._node_ns + self._line.at(self._node_ns))
        return NodeTime(stamp_ns, None if elapsed_ns is None else elapsed_ns * 1e-9)

    def _elapsed_ns(self, clock_us: int, arrival_ns: int) -> int | None:
        """Node time since the previous sample [ns], or None if the node's clock has jumped."""
        elapsed_us = signed(clock_us - self._clock_us, self._modulus_us)
        # After half a wrap or more, the host's clock determines the number of wraps.
        host_us = (arrival_ns - self._arrival_ns) // NS_PER_US
        wraps = round((host_us - elapsed_us) / self._modulus_us)
        elapsed_ns = (elapsed_us + wraps * self._modulus_us) * NS_PER_US
        node_ns = self._node_ns + elapsed_ns
        lateness_ns = arrival_ns - node_ns - self._line.at(node_ns)
        if elapsed_ns <= 0 or abs(lateness_ns) > JUMP_NS:
            return None
        return elapsed_ns


class CountingClock(_StampedSamples):
    """Stamps the samples of a device without a clock but with a constant rate.

    The count of samples replaces the clock. Lost samples are detected within two seconds, since all
    later arrivals appear late. ``clock_jumps`` are pauses, and steps back of the host's clock.
    """

    drift = 0.0
    """There is no clock."""

    def __init__(self) -> None:
        super().__init__()
        self._line: LowerLine | None = None
        self._first_ns: int | None = None
        self._count = 0
        self._period_ns = 0

    def stamp(self, arrival_ns: int) -> NodeTime:
        """The host time of the next sample, which arrived at this host time [ns]."""
        passed_ns = arrival_ns - self._arrival_ns
        begins = self._first_ns is None or not -JUMP_NS <= passed_ns <= PAUSE_NS
        self._arrival_ns = arrival_ns
        if begins:
            self.counters.add("clock_jumps", self._first_ns is not None)
            self._begin(arrival_ns)
        else:
            self._count += 1
        before_ns, line_ns = self._stamp_ns, self._next_stamp_ns(arrival_ns)
        stamp_ns = self._increasing(line_ns)
        is_behind = line_ns < before_ns - self._period_ns  # the host's clock was set back
        elapsed_ns = self._period_ns if is_behind else stamp_ns - before_ns
        return NodeTime(stamp_ns, None if begins else elapsed_ns * 1e-9)

    def _begin(self, arrival_ns: int) -> None:
        self._line, self._first_ns, self._count = None, arrival_ns, 0

    def _next_stamp_ns(self, arrival_ns: int) -> int:
        if self._line is None:
            self._estimate_period(arrival_ns)
            return arrival_ns
        node_ns = self._count * self._period_ns
        if self._line.add(node_ns, arrival_ns):
            self.counters.add("clock_steps")
        stamp_ns = node_ns + self._line.at(node_ns)
        if abs(self._line.skew) >= COUNTED_SKEW:
            self._begin(arrival_ns)  # the period was estimated from a backlog
        return stamp_ns

    def _estimate_period(self, arrival_ns: int) -> None:
        """Estimate a first period from the first samples."""
        elapsed_ns = arrival_ns - (self._first_ns or arrival_ns)
        if self._count < FIRST_SAMPLES or elapsed_ns < FIRST_NS:
            return
        self._period_ns = elapsed_ns // self._count
        self._line = LowerLine(
            COUNTED_SKEW,
            skew_blocks=2,
            step_ns=max(COUNTED_STEP_NS, round(COUNTED_STEP * self._period_ns)),
        )
