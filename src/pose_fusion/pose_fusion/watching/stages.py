"""How late a frame is at each stage of its way through the fusion."""

from collections import deque
from collections.abc import Mapping

import numpy as np

KEPT = 300  # [frames] the last ten seconds
PENDING = 16  # [frames] that are on their way, at most
STAGE = "latency_ms/"  # before the stages' names in the diagnostics
CAPTURE, TRANSPORT, FUSION = STAGES = ("capture_to_publication", "to_the_fusion", "to_the_output")


class LatencyStages:
    """Times of one sensor's last frames, by stage."""

    def __init__(self) -> None:
        self._times_ms: dict[str, deque[float]] = {name: deque(maxlen=KEPT) for name in STAGES}
        self._taken_ns: deque[int] = deque(maxlen=PENDING)

    def note_taken(self, stamp_ns: int, published_ns: int, now_ns: int) -> None:
        """A frame of this stamp, published at some time, is taken up."""
        self._times_ms[CAPTURE].append((published_ns - stamp_ns) * 1e-6)
        self._times_ms[TRANSPORT].append((now_ns - published_ns) * 1e-6)
        self._taken_ns.append(now_ns)

    def note_output(self, now_ns: int) -> None:
        """An estimate that the frames taken so far count in is published."""
        while self._taken_ns:
            self._times_ms[FUSION].append((now_ns - self._taken_ns.popleft()) * 1e-6)

    def as_dict(self) -> dict[str, str]:
        """Median and 99th percentile [ms] of each stage that is known."""
        return {
            STAGE + name: "{:.1f}, p99 {:.1f}".format(*np.percentile(times, [50, 99]))
            for name, times in self._times_ms.items()
            if times
        }


def reported_stages(values: Mapping[str, str]) -> dict[str, str]:
    """Text of each stage among the values of a node's report: those of a :class:`LatencyStages`."""
    return {
        name.removeprefix(STAGE): text for name, text in values.items() if name.startswith(STAGE)
    }
