"""``smoothed``: the default estimator with fixed-lag smoothing, for recordings only."""

from bisect import insort
from collections import deque
from typing import Any, NamedTuple

from pose_core.estimates.observation import Observation
from pose_core.estimates.poses import TimedPose
from pose_core.estimators.default import DefaultEstimator
from pose_core.estimators.uncertainty import SMOOTHED
from pose_core.filter.smoother import FilterStep, smoothed
from pose_core.filter.state import FilterState
from pose_core.kernels.published_state import PublishedState
from pose_core.stamps import JUMP_BACK_NS, NS_PER_S

ORDERED_NS = NS_PER_S // 4  # frames at most this late are processed in stamp order
LOOKAHEAD_NS = 3 * NS_PER_S // 2  # later samples do not improve a pose any more
CHUNK_NS = NS_PER_S  # published together


class _Step(NamedTuple):
    stamp_ns: int  # [ns]
    published: PublishedState  # as the filter published it
    filter_step: FilterStep


class SmoothedEstimator(DefaultEstimator):
    """Stores the last filter steps, and smooths and publishes them once later steps are known."""

    NEEDS_FUTURE = True
    CAN_PREDICT = False
    VARIANCE_CALIBRATION = SMOOTHED

    def __init__(self, *arguments: Any, **named: Any) -> None:
        super().__init__(*arguments, **named)
        self._waiting: list[Observation] = []  # in the order of their stamps
        self._steps: deque[_Step] = deque()
        self._before_update: FilterState | None = None
        self._discontinuities = 0

    def track(self, observation: Observation) -> list[TimedPose]:
        """Take an observation; return the poses that are old enough to be published."""
        poses: list[TimedPose] = []
        if self._waiting and observation.stamp_ns < self._waiting[-1].stamp_ns - JUMP_BACK_NS:
            poses += self.flush()  # the recording has restarted
        insort(self._waiting, observation, key=lambda waiting: waiting.stamp_ns)
        newest_ns = self._waiting[-1].stamp_ns
        while self._waiting[0].stamp_ns < newest_ns - ORDERED_NS:
            self._process(self._waiting.pop(0))
        if self._steps:
            first_ns = self._steps[0].stamp_ns
            if self._steps[-1].stamp_ns - first_ns > LOOKAHEAD_NS + CHUNK_NS:
                poses += self._publish_until(first_ns + CHUNK_NS)
        return poses

    def flush(self) -> list[TimedPose]:
        """The remaining poses, after the end of the streams."""
        while self._waiting:
            self._process(self._waiting.pop(0))
        return self._publish_until(self._steps[-1].stamp_ns) if self._steps else []

    def _predict_or_start(self, observation: Observation) -> bool:
        is_used = super()._predict_or_start(observation)
        if is_used and self._filter.state is not None:
            self._before_update = self._filter.state.copy()
        return is_used

    def _process(self, observation: Observation) -> None:
        """Store a step; a step with a half-turn correction is not connected to the one before."""
        published = self.update(observation)
        if published is None or self._filter.state is None:
            return
        discontinuities = self.counters["limbs_turned_back"] + self.counters["filter_starts"]
        follows = self._steps and discontinuities == self._discontinuities
        self._discontinuities = discontinuities
        dt_ns = observation.stamp_ns - self._steps[-1].stamp_ns if self._steps else 0
        step = FilterStep(
            dt_s=dt_ns / NS_PER_S,
            predicted=self._before_update if follows else None,
            updated=self._filter.state.copy(),
        )
        self._steps.append(_Step(observation.stamp_ns, published, step))

    def _publish_until(self, until_ns: int) -> list[TimedPose]:
        """Smooth all steps and publish those up to an instant."""
        steps = [step.filter_step for step in self._steps]
        poses: list[TimedPose] = []
        for state in smoothed(steps, self._filter.layout, self.tuning.motion):
            if not self._steps or self._steps[0].stamp_ns > until_ns:
                break
            stamp_ns, published, _ = self._steps.popleft()
            pose = self._output.published(state, published.information)
            pose = pose._replace(scale=published.scale)
            poses.append(TimedPose(stamp_ns=stamp_ns, pose=pose))
        return poses
