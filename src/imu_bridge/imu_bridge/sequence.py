"""What one node's sequence numbers and clock say of lost, repeated and late frames."""

from enum import Enum

from imu_bridge.protocols.star import CLOCK_MODULUS_US, SEQUENCE_MODULUS
from pose_common.counters import Counters

LATE_FRAMES = 16  # [-] a radio's retransmission comes at most so many frames late
LATE_US = 1_000_000  # [us] and at most so much


class Arrival(Enum):
    """What a frame is, seen after the frames before it."""

    NEXT = "next"
    DUPLICATE = "duplicate"
    LATE = "late"
    RESTART = "restart"


class SequenceTracker:
    """Follows one node's frames.

    Attributes:
        counters: ``frames``: all that arrived; ``lost``: numbers that never came in time;
            ``duplicates`` and ``late``: frames to be thrown away, since the samples of a node
            must not run backwards; ``restarts`` of the node.
    """

    def __init__(self) -> None:
        self.counters = Counters("frames", "lost", "duplicates", "late", "restarts")
        self._sequence: int | None = None
        self._clock_us = 0

    def classify(self, sequence: int, clock_us: int) -> Arrival:
        """Judge a frame by its sequence number and node clock, and count it."""
        self.counters.add("frames")
        if self._sequence is None:
            self._sequence, self._clock_us = sequence, clock_us
            return Arrival.NEXT
        step = signed(sequence - self._sequence, SEQUENCE_MODULUS)
        elapsed_us = signed(clock_us - self._clock_us, CLOCK_MODULUS_US)
        if step == 0 and elapsed_us == 0:
            self.counters.add("duplicates")
            return Arrival.DUPLICATE
        if -LATE_FRAMES <= step < 0 and -LATE_US < elapsed_us < 0:
            self.counters.add("late")
            return Arrival.LATE
        self._sequence, self._clock_us = sequence, clock_us
        if step <= 0 or elapsed_us <= 0:
            self.counters.add("restarts")
            return Arrival.RESTART
        self.counters.add("lost", step - 1)
        return Arrival.NEXT


def signed(difference: int, modulus: int) -> int:
    """The smallest number in size that equals a difference of wrapping counters."""
    half = modulus // 2
    return (difference + half) % modulus - half
