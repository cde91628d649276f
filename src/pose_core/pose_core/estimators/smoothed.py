"""``smoothed``: the default estimator that may look ahead, for recordings only."""

from collections import deque
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from pose_core.body.model import BodyModel
from pose_core.body.shape import BodyShape
from pose_core.counters import Counters
from pose_core.estimators.segments import SegmentEstimator
from pose_core.estimators.uncertainty import LOOKING_AHEAD, Trusts
from pose_core.filters.segment_smoother import FilterStep, smoothed
from pose_core.fusion.observation_block import ObservationBlock
from pose_core.fusion.parameters import FusionParameters
from pose_core.fusion.pose_block import PoseBlock, TimedPose
from pose_core.kernels import following as kernel
from pose_core.kernels.compiling import settled
from pose_core.kernels.fit import scale_of
from pose_core.kernels.following import Seen
from pose_core.kernels.handover import make_handover
from pose_core.stamps import NS_PER_S
from pose_core.streams.samples import FloatArray

LOOKAHEAD_NS = 3 * NS_PER_S // 2  # of what comes later nothing more is to be learnt
CHUNK_NS = NS_PER_S  # told at once


@dataclass(frozen=True, kw_only=True)
class _Step:
    stamp_ns: int  # [ns] of the filter
    seen_ns: int  # [ns] of the observation
    tracking_state: NDArray[np.uint8]  # (sensors, 15)
    information: FloatArray  # see StateNumbers
    filter_step: FilterStep
    scale: float  # of the variances [-]


class SmoothedEstimator(SegmentEstimator):
    """Keeps the filter's last steps, and tells each when the next seconds are known."""

    NEEDS_FUTURE: ClassVar[bool] = True
    TRUSTS: ClassVar[Trusts] = LOOKING_AHEAD

    def __init__(
        self,
        model: BodyModel,
        shape: BodyShape,
        parameters: FusionParameters,
        counters: Counters,
    ) -> None:
        super().__init__(model, shape, parameters, counters)
        self._go_on, self._take = settled(kernel.go_on), settled(kernel.take)
        self._settle = settled(kernel.settle)
        self._steps: deque[_Step] = deque()
        self._told_ns = 0

    def track(self, block: ObservationBlock) -> PoseBlock | None:
        """Take observations; the poses that are old enough to be told."""
        seen = self._seen(block)
        told: list[TimedPose] = []
        newest_ns: list[int] = []
        for row, stamp_ns in enumerate(block.stamps_ns.tolist()):
            before = len(told)
            if stamp_ns < self._filter_ns - NS_PER_S:  # a recording that begins anew
                told += self.flush()
                self._told_ns = 0
            self._step(block, seen, row)
            steps = self._steps
            if steps and self._filter_ns - steps[0].stamp_ns > LOOKAHEAD_NS + CHUNK_NS:
                told += self._tell(steps[0].stamp_ns + CHUNK_NS)
            newest_ns += [int(block.newest_ns[row])] * (len(told) - before)
        self._count()
        return self.block_of(told, newest_ns) if told else None

    def flush(self) -> list[TimedPose]:
        """All poses that are left: nothing comes any more."""
        return self._tell(self._steps[-1].stamp_ns) if self._steps else []

    @property
    def _filter_ns(self) -> int:
        return int(self._known.instants_ns[kernel.FILTER])

    def _step(self, block: ObservationBlock, seen: Seen, row: int) -> None:
        """Take one observation, and keep what the filter knew before and after."""
        rules, positions = self._rules, block.positions[row]
        information = np.empty((2, len(rules.parents), 3, 3))
        ended = self._go_on(rules, seen, self._known, row, self._filter.state is not None)
        begins: int | None = kernel.GOING_ON
        if ended == kernel.TO_START:
            begins = self._see_to(ended, positions)
        if ended == kernel.TOO_LATE or begins is None:
            return
        predicted = self._filter.known_state.copy() if begins == kernel.GOING_ON else None
        flipped = int(self._known.counts[kernel.TURNED_BACK])
        ended = self._take(rules, seen, self._known, row, information)
        if ended < kernel.TOO_LATE:
            begins = self._see_to(ended, positions)
        if begins is None:
            return
        follows = ended >= kernel.TAKEN and flipped == self._known.counts[kernel.TURNED_BACK]
        dt_ns = self._filter_ns - self._steps[-1].stamp_ns if self._steps else 0
        self._steps.append(
            _Step(
                stamp_ns=self._filter_ns,
                seen_ns=int(block.stamps_ns[row]),
                tracking_state=block.tracking_state[row],
                information=information,
                filter_step=FilterStep(
                    dt_s=dt_ns / NS_PER_S,
                    predicted=predicted if follows else None,
                    updated=self._filter.known_state.copy(),
                ),
                scale=scale_of(self._known.fit),
            )
        )
        self._settle(rules, seen, self._known, row, begins, ended == kernel.REOPENED)

    def _tell(self, until_ns: int) -> list[TimedPose]:
        """Smooth all steps and tell the first of them, up to an instant."""
        states = smoothed([step.filter_step for step in self._steps], self._filter.motion)
        glide = make_handover(len(self._rules.parents)).glide
        told: list[TimedPose] = []
        for state in states:
            if not self._steps or self._steps[0].stamp_ns > until_ns:
                break
            step = self._steps.popleft()
            if step.seen_ns <= self._told_ns:
                continue  # a late frame's instant has been told already
            self._told_ns = step.seen_ns
            pose = self._kept(state, glide, step.information, step.scale)
            told.append(
                TimedPose(stamp_ns=step.seen_ns, tracking_state=step.tracking_state, pose=pose)
            )
        return told
