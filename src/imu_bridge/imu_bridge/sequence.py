"""What one node's sequence numbers and clock say of lost, repeated and late frames."""

from enum import Enum

from pose_core.counters import Counters

SEQUENCE_MODULUS = 1 << 16
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

    Args:
        clock_modulus_us: Where the node's clock wraps [us].

    Attributes:
        counters: ``frames``: all that arrived; ``lost``: numbers that never came in time;
            ``duplicates`` and ``late``: frames to be thrown away, since the samples of a node
            must not run backwards; ``restarts`` of the node.
    """

    def __init__(self, clock_modulus_us: int = 1 << 32) -> None:
        self.counters = Counters("frames", "lost", "duplicates", "late", "restarts")
        self._clock_modulus_us = clock_modulus_us
        self._sequence: int | None = None
        self._clock_us: int | None = None

    def classify(self, sequence: int | None, clock_us: int | None) -> Arrival:
        """Judge a frame by its sequence number and node clock, and count it.

        Args:
            sequence: Modulo 2^16; None if the device does not count, and then no loss is seen.
            clock_us: Modulo the clock's modulus [us]; None if the device tells no time.
        """
        self.counters.add("frames")
        step = elapsed_us = None
        if sequence is not None and self._sequence is not None:
            step = signed(sequence - self._sequence, SEQUENCE_MODULUS)
        if clock_us is not None and self._clock_us is not None:
            elapsed_us = signed(clock_us - self._clock_us, self._clock_modulus_us)
        arrival = _judged(step, elapsed_us)
        if arrival in (Arrival.DUPLICATE, Arrival.LATE):
            self.counters.add("duplicates" if arrival is Arrival.DUPLICATE else "late")
            return arrival
        self._sequence, self._clock_us = sequence, clock_us
        if arrival is Arrival.RESTART:
            self.counters.add("restarts")
        elif step is not None:
            self.counters.add("lost", step - 1)
        return arrival


def _judged(step: int | None, elapsed_us: int | None) -> Arrival:
    """What a step of number and clock means; None for one that is not known."""
    known = [value for value in (step, elapsed_us) if value is not None]
    if not known:
        return Arrival.NEXT
    if not any(known):
        return Arrival.DUPLICATE
    if (step is None or -LATE_FRAMES <= step < 0) and (
        elapsed_us is None or -LATE_US < elapsed_us < 0
    ):
        return Arrival.LATE
    return Arrival.RESTART if min(known) <= 0 else Arrival.NEXT


def signed(difference: int, modulus: int) -> int:
    """The smallest number in size that equals a difference of wrapping counters."""
    half = modulus // 2
    return (difference + half) % modulus - half
