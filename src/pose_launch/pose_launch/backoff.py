"""How long to wait before a process that has died is started again."""

RECOVERED_S = 10.0  # [s] one that has run as long has recovered: the next wait is the first again
LONGEST_DELAY_S = 30.0  # [s]


class BackOff:
    """Delays that double from death to death, and begin anew after a long life.

    Args:
        first_s: The first delay [s].
    """

    def __init__(self, first_s: float) -> None:
        self._first_s = first_s
        self._next_s = first_s

    def delay_s(self, lived_s: float) -> float:
        """The delay [s] after a process that has run for ``lived_s`` [s]."""
        delay_s = self._first_s if lived_s >= RECOVERED_S else self._next_s
        self._next_s = max(self._first_s, min(2.0 * delay_s, LONGEST_DELAY_S))
        return delay_s
