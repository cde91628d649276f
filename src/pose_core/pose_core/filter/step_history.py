"""The last steps of a filter, to which it goes back when a camera's frame comes late.

One tracker may take 60 ms longer than another. When its frame comes, the filter is past the frame's
instant. It goes back to its state before that instant, takes the frame, and repeats the later
steps, so that the result is nearly the one that it would have with all frames in order.
"""

from collections import deque
from collections.abc import Sequence
from typing import NamedTuple

from pose_core.arrays import FloatArray
from pose_core.filter.error_state_filter import ErrorStateFilter
from pose_core.filter.frame import CameraFrame
from pose_core.filter.imu import ImuFrame
from pose_core.filter.state import FilterState
from pose_core.kernels.published_state import CAMERAS, IMUS
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
    """The instant of a filter, and its last steps, kept from the first late frame on.

    Most streams have no late frame.

    Args:
        error_state: The filter.
    """

    def __init__(self, error_state: ErrorStateFilter) -> None:
        self._filter = error_state
        self.stamp_ns = 0
        """Instant of the filter's state [ns]."""
        self._is_kept = False
        self._steps: deque[KeptStep] = deque()
        self._begun: tuple[int, FilterState] | None = None

    def restart(self, stamp_ns: int) -> None:
        """Begin at the instant at which the filter has started."""
        self.clear()
        self.stamp_ns = stamp_ns

    def clear(self) -> None:
        """Forget all steps: the state has changed by more than measurements."""
        self._steps.clear()
        self._begun = None

    def predict_to(self, stamp_ns: int) -> None:
        """Begin a step: keep the state before it, and predict the filter to its instant."""
        assert self._filter.state is not None
        if self._is_kept:
            self._begun = self.stamp_ns, self._filter.state.copy()
        if stamp_ns > self.stamp_ns:
            self._filter.predict((stamp_ns - self.stamp_ns) / NS_PER_S)
            self.stamp_ns = stamp_ns

    def finish(
        self,
        heading_walks: Sequence[tuple[int, float]],
        imus: ImuFrame,
        frames: Sequence[CameraFrame],
    ) -> None:
        """Keep what the step has done."""
        if self._begun is None:
            return
        self._steps.append(KeptStep(*self._begun, self.stamp_ns, heading_walks, imus, frames))
        self._begun = None
        while self._steps[0].stamp_ns < self.stamp_ns - REACH_NS:
            self._steps.popleft()

    def go_back(self, stamp_ns: int) -> list[KeptStep]:
        """Go back to the state before an instant.

        Returns:
            The steps later than the instant; none, and the filter stays, if it is before them all.
        """
        self._is_kept = True
        if not self._steps or stamp_ns < self._steps[0].from_ns:
            return []
        later: list[KeptStep] = []
        while self._steps and self._steps[-1].stamp_ns > stamp_ns:
            later.insert(0, self._steps.pop())
        if later:
            self._filter.go_back(later[0].before)
            self.stamp_ns = later[0].from_ns
        return later

    def repeat(self, step: KeptStep, information: FloatArray) -> None:
        """Repeat a step that is later than the filter's instant.

        Args:
            step: The step.
            information: Of the updates, (2, links, 3, 3) [1/rad²]; is written.
        """
        self.predict_to(step.stamp_ns)
        assert self._filter.state is not None
        for column, variance in step.heading_walks:
            self._filter.state.P[column, column] += variance
        self._filter.update_with_imus(step.imus, information[IMUS])
        for frame in step.frames:
            if self._filter.state is not None:
                self._filter.update_with_frame(frame, information[CAMERAS])
        self.finish(step.heading_walks, step.imus, step.frames)
