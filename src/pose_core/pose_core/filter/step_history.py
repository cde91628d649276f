"""The last steps of a filter, to which it goes back when a camera's frame comes late.

One tracker may take 60 ms longer than another. When its frame comes, the filter is past the frame's
instant. It goes back to its state before that instant, takes the frame, and repeats the later
steps, so that the result is the one that it would have with all frames in order.
"""

from collections import deque
from collections.abc import Sequence
from typing import NamedTuple

from pose_core.filter.frame import CameraFrame
from pose_core.filter.imu import ImuFrame
from pose_core.filter.state import FilterState
from pose_core.stamps import NS_PER_S

REACH_NS = NS_PER_S // 5  # [ns] of the steps kept; frames that come later are not used


class KeptStep(NamedTuple):
    """What one step has done: enough to repeat it."""

    from_ns: int  # instant of the state before it [ns]
    before: FilterState
    stamp_ns: int  # its own instant [ns]
    heading_walks: Sequence[tuple[int, float]]  # columns of P, and variance added [rad²]
    imus: ImuFrame
    frames: Sequence[CameraFrame]  # with swapped sides exchanged


class StepHistory:
    """Keeps the last steps, from the first late frame on: most streams have none."""

    def __init__(self) -> None:
        self._is_kept = False
        self._steps: deque[KeptStep] = deque()
        self._begun: tuple[int, FilterState] | None = None

    def begin(self, from_ns: int, state: FilterState) -> None:
        """Keep the state before a step."""
        if self._is_kept:
            self._begun = from_ns, state.copy()

    def finish(
        self,
        stamp_ns: int,
        heading_walks: Sequence[tuple[int, float]],
        imus: ImuFrame,
        frames: Sequence[CameraFrame],
    ) -> None:
        """Keep what the step has done."""
        if self._begun is None:
            return
        self._steps.append(KeptStep(*self._begun, stamp_ns, heading_walks, imus, frames))
        self._begun = None
        while self._steps[0].stamp_ns < stamp_ns - REACH_NS:
            self._steps.popleft()

    def clear(self) -> None:
        """Forget all steps: the state has changed by more than measurements."""
        self._steps.clear()
        self._begun = None

    def take_after(self, stamp_ns: int) -> list[KeptStep]:
        """Remove and return the steps later than an instant; none if it is before them all."""
        self._is_kept = True
        if not self._steps or stamp_ns < self._steps[0].from_ns:
            return []
        later: list[KeptStep] = []
        while self._steps and self._steps[-1].stamp_ns > stamp_ns:
            later.insert(0, self._steps.pop())
        return later
