"""``smoothed``: the default estimator that may look ahead, for recordings only."""

from collections import deque
from dataclasses import dataclass
from typing import ClassVar

from pose_common.counters import Counters
from pose_common.stamps import NS_PER_S
from pose_fusion.body.model import BodyModel
from pose_fusion.body.shape import BodyShape
from pose_fusion.filters.segment_filter import UpdateReport
from pose_fusion.filters.segment_smoother import FilterStep, smoothed
from pose_fusion.filters.segment_state import SegmentState
from pose_fusion.fusion.estimators.estimator import Observation, TimedPose, timed
from pose_fusion.fusion.estimators.handover import no_glide
from pose_fusion.fusion.estimators.segments import SegmentEstimator
from pose_fusion.fusion.estimators.uncertainty import LOOKING_AHEAD, Trusts, scale_of
from pose_fusion.fusion.parameters import FusionParameters

LOOKAHEAD_NS = 3 * NS_PER_S // 2  # of what comes later nothing more is to be learnt
CHUNK_NS = NS_PER_S  # told at once


@dataclass(frozen=True, kw_only=True)
class _Step:
    stamp_ns: int
    observation: Observation
    report: UpdateReport
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
        self._steps: deque[_Step] = deque()
        self._told_ns = 0

    def advance(self, observation: Observation) -> list[TimedPose]:
        """Take an observation; the poses that are old enough to be told."""
        told: list[TimedPose] = []
        if observation.stamp_ns < self._stamp_ns - NS_PER_S:  # a recording that begins anew
            told = self.flush()
            self._told_ns = 0
        self._take(observation)  # nothing is read yet: angles go on from what was told last
        if self._steps and self._stamp_ns - self._steps[0].stamp_ns > LOOKAHEAD_NS + CHUNK_NS:
            told += self._tell(self._steps[0].stamp_ns + CHUNK_NS)
        return told

    def flush(self) -> list[TimedPose]:
        """All poses that are left: nothing comes any more."""
        return self._tell(self._steps[-1].stamp_ns) if self._steps else []

    def _correct(
        self, observation: Observation, late_s: float, shown: SegmentState | None
    ) -> UpdateReport | None:
        state = self._filter.state
        predicted = state.copy() if state is not None and state is shown else None
        report = super()._correct(observation, late_s, shown)
        updated = self._filter.state
        if report is None or updated is None:
            return report
        follows = predicted is not None and report.outcome.flipped == 0 and updated is state
        dt_ns = self._stamp_ns - self._steps[-1].stamp_ns if self._steps else 0
        step = FilterStep(
            dt_s=dt_ns / NS_PER_S,
            predicted=predicted if follows else None,
            updated=updated.copy(),
        )
        self._steps.append(
            _Step(
                stamp_ns=self._stamp_ns,
                observation=observation,
                report=report,
                filter_step=step,
                scale=scale_of(self._fit.distance),
            )
        )
        return report

    def _tell(self, until_ns: int) -> list[TimedPose]:
        """Smooth all steps and tell the first of them, up to an instant."""
        states = smoothed([step.filter_step for step in self._steps], self._filter.motion)
        glide = no_glide(len(self._filter.tree.parents))
        told: list[TimedPose] = []
        for state in states:
            if not self._steps or self._steps[0].stamp_ns > until_ns:
                break
            step = self._steps.popleft()
            if step.observation.stamp_ns <= self._told_ns:
                continue  # a late frame's instant has been told already
            self._told_ns = step.observation.stamp_ns
            pose = self._kept(state, glide, step.report, step.scale)
            told.append(timed(pose, step.observation))
        return told
