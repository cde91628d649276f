"""Output instants of the estimates."""

from collections.abc import Iterator

from pose_core.estimators.parameters import PipelineParameters
from pose_core.estimators.registry import estimator_class
from pose_core.stamps import JUMP_BACK_NS, NS_PER_S


def has_output_rate(parameters: PipelineParameters) -> bool:
    """Whether estimates are made at ``output_rate``; otherwise one for each frame."""
    can_predict = estimator_class(parameters.estimator).CAN_PREDICT
    return can_predict and parameters.output_rate > 0.0


class OutputGrid:
    """Regular grid of output instants, in strictly increasing order.

    Args:
        rate: Rate of the grid [Hz].
        longest_gap_s: Time [s] after the last known state from which on nothing is published.
    """

    def __init__(self, rate: float, longest_gap_s: float) -> None:
        self.period_ns = round(NS_PER_S / rate)
        self._longest_gap_ns = round(longest_gap_s * NS_PER_S)
        self.last_ns: int | None = None
        """The last instant published or passed [ns]."""

    def before(self, stamp_ns: int) -> Iterator[int]:
        """Instants of a recording before ``stamp_ns``; in a long gap only the first ones."""
        last_ns = self.last_ns
        if last_ns is None or stamp_ns < last_ns - JUMP_BACK_NS:
            self.last_ns = (stamp_ns - 1) // self.period_ns * self.period_ns
            return
        end_ns = (stamp_ns - 1) // self.period_ns * self.period_ns
        first_ns = last_ns + self.period_ns
        for instant_ns in range(
            first_ns, min(end_ns, last_ns + self._longest_gap_ns) + 1, self.period_ns
        ):
            self.last_ns = instant_ns
            yield instant_ns
        self.last_ns = max(self.last_ns or end_ns, end_ns)

    def until(self, now_ns: int, longest_backlog_ns: int) -> tuple[range, int]:
        """Live instants up to now [ns], the newest ones of a backlog; and the number omitted.

        The grid starts a quarter of a period before the ``now`` of the first call, so that calls
        with the same period find one instant each.
        """
        if self.last_ns is None or now_ns < self.last_ns - JUMP_BACK_NS:
            self.last_ns = now_ns - self.period_ns // 4 - self.period_ns
        count = (now_ns - self.last_ns) // self.period_ns
        if count <= 0:
            return range(0), 0
        skipped = max(0, count - max(1, longest_backlog_ns // self.period_ns))
        first_ns = self.last_ns + (skipped + 1) * self.period_ns
        self.last_ns += count * self.period_ns
        return range(first_ns, self.last_ns + 1, self.period_ns), skipped
