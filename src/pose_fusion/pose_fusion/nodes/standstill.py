"""Whether a node hears its sources again after its process stood still.

The middleware may deliver nothing more to a process that was suspended for some seconds, though its
subscriptions are matched: seen with Fast DDS 2.14, over shared memory and over UDP (figures in
``docs/reliability.md``). New subscriptions hear nothing either; a new process does.
"""

from collections.abc import Callable, Mapping
from time import monotonic, process_time

from pose_core.errors import InputError
from pose_fusion.nodes.inbox import MessageQueue

STANDSTILL_S = 1.0  # [s] between two calls, from which on the process may have stood still
WORKING = 0.2  # [-] share of CPU in that time, from which on it worked instead
DRAIN_S = 0.1  # [s] for messages that came before
HEARS_WITHIN_S = 0.7  # [s] after it


class Standstill:
    """Finds sources that were heard before a standstill, but not after it.

    Args:
        queues: The subscriptions, by source.
        clock: A monotonic clock [s].
        cpu_clock: CPU time of this process [s].
    """

    def __init__(
        self,
        queues: Mapping[str, MessageQueue],
        clock: Callable[[], float] = monotonic,
        cpu_clock: Callable[[], float] = process_time,
    ) -> None:
        self._queues = queues
        self._clock, self._cpu_clock = clock, cpu_clock
        self._last_s, self._last_cpu_s = clock(), cpu_clock()
        self._end_s: float | None = None  # of a standstill
        self._newest: dict[str, int] = {}  # message's number soon after it

    def check(self) -> None:
        """Call it regularly.

        Raises:
            InputError: If sources are not heard any more, once after a standstill.
        """
        deaf = self._deaf()
        if deaf:
            raise InputError(
                f"{', '.join(deaf)} not heard since this process stood still, though published: "
                "the middleware delivers nothing more; start the node again (./pose up does it)"
            )

    def _deaf(self) -> tuple[str, ...]:
        now_s, cpu_s = self._clock(), self._cpu_clock()
        since_s, worked_s = now_s - self._last_s, cpu_s - self._last_cpu_s
        self._last_s, self._last_cpu_s = now_s, cpu_s
        if since_s > STANDSTILL_S and worked_s < WORKING * since_s:
            self._end_s, self._newest = now_s, {}
        if self._end_s is None or now_s < self._end_s + DRAIN_S:
            return ()
        if not self._newest:
            self._newest = {name: queue.newest for name, queue in self._queues.items()}
        if now_s < self._end_s + DRAIN_S + HEARS_WITHIN_S:
            return ()
        self._end_s = None
        stalled = [n for n, queue in self._queues.items() if 0 < self._newest[n] == queue.newest]
        return tuple(name for name in stalled if self._queues[name].has_publisher)
