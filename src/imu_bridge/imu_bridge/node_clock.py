r"""From a node's clock to the host's: stamps without the jitter of radio and serial port.

A sample taken at node time :math:`n` arrives at host time :math:`a = n + o(n) + d` with a slowly
drifting offset :math:`o` and a delay :math:`d \ge d_0`. The lower envelope of :math:`a - n` follows
:math:`o + d_0`: it drops at once to every smaller difference and otherwise rises by the largest
drift that two crystals can have. The stamp is node time plus envelope: as regular as the node's
clock, never after the arrival.
"""

from dataclasses import dataclass

from imu_bridge.protocols.star import CLOCK_MODULUS_US
from imu_bridge.sequence import signed
from pose_common.counters import Counters

NS_PER_US = 1000
HOLD_NS = 1000  # [ns] step of a stamp that would run backwards


@dataclass(frozen=True, kw_only=True, slots=True)
class NodeTime:
    """When a sample was taken.

    Attributes:
        stamp_ns: Host time of the sample, greater than that of the node's sample before.
        elapsed_s: Time since the node's sample before, by the node's own clock; None for the
            first sample, and for the first after a jump of that clock.
    """

    stamp_ns: int
    elapsed_s: float | None


class NodeClock:
    """Maps the wrapping clock of one node to host time.

    Args:
        max_drift: Largest relative drift between the two clocks [s/s].
        jump_s: Clocks that disagree by more than this have jumped (the node restarted): the
            mapping begins anew [s].

    Attributes:
        counters: ``clock_jumps``, and ``stamps_held``: stamps that would have run backwards,
            because the envelope dropped by more than the time between two samples.
    """

    def __init__(self, max_drift: float = 100e-6, jump_s: float = 5.0) -> None:
        self.counters = Counters("clock_jumps", "stamps_held")
        self._max_drift = max_drift
        self._jump_ns = round(jump_s * 1e9)
        self._clock_us: int | None = None
        self._arrival_ns = 0
        self._node_ns = 0  # unwrapped
        self._offset_ns = 0
        self._stamp_ns = 0

    def stamp(self, clock_us: int, arrival_ns: int) -> NodeTime:
        """The host time of a sample.

        Args:
            clock_us: Node clock in the frame [us], modulo 2³².
            arrival_ns: Host time at which the frame arrived [ns].
        """
        if self._clock_us is None:
            elapsed_ns = None
        else:
            elapsed_ns = self._elapsed_ns(self._clock_us, clock_us, arrival_ns)
            if elapsed_ns is None:
                self.counters.add("clock_jumps")
        self._clock_us, self._arrival_ns = clock_us, arrival_ns
        if elapsed_ns is None:
            self._node_ns = clock_us * NS_PER_US
            self._offset_ns = arrival_ns - self._node_ns
        else:
            self._node_ns += elapsed_ns
            self._offset_ns = min(
                self._offset_ns + round(elapsed_ns * self._max_drift), arrival_ns - self._node_ns
            )
        stamp_ns = self._node_ns + self._offset_ns
        if stamp_ns <= self._stamp_ns:
            self.counters.add("stamps_held")
            stamp_ns = self._stamp_ns + HOLD_NS
        self._stamp_ns = stamp_ns
        elapsed_s = None if elapsed_ns is None else elapsed_ns * 1e-9
        return NodeTime(stamp_ns=stamp_ns, elapsed_s=elapsed_s)

    def _elapsed_ns(self, before_us: int, clock_us: int, arrival_ns: int) -> int | None:
        """Node time since the sample before, or None if the node's clock has jumped."""
        elapsed_us = signed(clock_us - before_us, CLOCK_MODULUS_US)
        # A silence of half a wrap and more: the host's clock says how often it has wrapped.
        host_us = (arrival_ns - self._arrival_ns) // NS_PER_US
        wraps = round((host_us - elapsed_us) / CLOCK_MODULUS_US)
        elapsed_ns = (elapsed_us + wraps * CLOCK_MODULUS_US) * NS_PER_US
        lateness_ns = arrival_ns - (self._node_ns + elapsed_ns) - self._offset_ns
        if elapsed_ns <= 0 or abs(lateness_ns) > self._jump_ns:
            return None
        return elapsed_ns
