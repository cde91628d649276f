"""Detection of lost, repeated and late frames by a node's sequence numbers and clock."""

from enum import Enum

from pose_core.counters import Counters

SEQUENCE_MODULUS = 1 << 16
LATE_FRAMES = 16  # [-] largest delay of a retransmission, in frames
LATE_US = 1_000_000  # [us] and in time


class Arrival(Enum):
    """Classification of a frame relative to the node's previous frames."""

    NEXT = "next"
    DUPLICATE = "duplicate"
    LATE = "late"
    RESTART = "restart"


class SequenceTracker:
    """Tracks one node's sequence numbers.

    Args:
        clock_modulus_us: Modulus of the node's clock [us].

    Attributes:
        counters: ``frames``: all frames; ``lost``: missing numbers; ``duplicates`` and ``late``:
            frames that are dropped, since the stamps of a node must increase; ``restarts`` of the
            node.
    """

    def __init__(self, clock_modulus_us: int = 1 << 32) -> None:
        self.counters = Counters("frames", "lost", "duplicates", "late", "restarts")
        self._clock_modulus_us = clock_modulus_us
        self._sequence: int | None = None
        self._clock_us: int | None = None

    def classify(self, sequence: int | None, clock_us: int | None) -> Arrival:
        """Classify a frame by its sequence number and node clock, and count it.

        Args:
            sequence: Modulo 2^16; None if the device has none: losses are not detected then.
            clock_us: Modulo the clock's modulus [us]; None if the device has none.
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
    """Classify the steps of number and clock [us]; None for an unknown one."""
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
    """Difference of wrapping counters with the smallest absolute value."""
    half = modulus // 2
    return (difference + half) % modulus - half
