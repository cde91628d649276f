"""The instants that are published: a regular grid of stamps, live and offline."""

from collections.abc import Iterator

from pose_core.stamps import NS_PER_S

JUMP_BACK_NS = NS_PER_S  # [ns] further back than this, a recording has begun anew


class OutputGrid:
    """Instants of one period, each given once, in strictly increasing order.

    Args:
        rate: [Hz].
        longest_gap_s: [s] after the last known state nothing is published.
    """

    def __init__(self, rate: float, longest_gap_s: float) -> None:
        self.period_ns = round(NS_PER_S / rate)
        self._longest_gap_ns = round(longest_gap_s * NS_PER_S)
        self._last_ns: int | None = None

    def before(self, stamp_ns: int) -> Iterator[int]:
        """Those before an instant [ns], of a recording; of a long gap, the first ones."""
        last_ns = self._last_ns
        if last_ns is None or stamp_ns < last_ns - JUMP_BACK_NS:
            self._last_ns = (stamp_ns - 1) // self.period_ns * self.period_ns
            return
        end_ns = (stamp_ns - 1) // self.period_ns * self.period_ns
        first_ns = last_ns + self.period_ns
        for instant_ns in range(
            first_ns, min(end_ns, last_ns + self._longest_gap_ns) + 1, self.period_ns
        ):
            self._last_ns = instant_ns
            yield instant_ns
        self._last_ns = max(self._last_ns or end_ns, end_ns)

    def until(self, now_ns: int, longest_backlog_ns: int) -> tuple[range, int]:
        """Those up to now [ns], live, of a backlog the newest ones; and how many are left out.

        The grid lies a quarter of a period before the first call's now, so that calls of the same
        period find one instant each.
        """
        if self._last_ns is None or now_ns < self._last_ns - JUMP_BACK_NS:
            self._last_ns = now_ns - self.period_ns // 4 - self.period_ns
        count = (now_ns - self._last_ns) // self.period_ns
        if count <= 0:
            return range(0), 0
        skipped = max(0, count - max(1, longest_backlog_ns // self.period_ns))
        first_ns = self._last_ns + (skipped + 1) * self.period_ns
        self._last_ns += count * self.period_ns
        return range(first_ns, self._last_ns + 1, self.period_ns), skipped
