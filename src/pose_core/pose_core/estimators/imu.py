"""``imu``: only the IMUs, after the cameras have aligned them at the start."""

from collections.abc import Sequence

from pose_core.estimators.default import DefaultEstimator
from pose_core.filter.state import FilterState
from pose_core.kernels.published_state import CAMERAS
from pose_core.stamps import NS_PER_S

WARM_UP_NS = 30 * NS_PER_S  # time that the other IMUs have after the first one is aligned
STILL_NS = 10 * NS_PER_S  # the same of IMUs that have not moved, or are silent then


class ImuEstimator(DefaultEstimator):
    """The default estimator, which ignores the cameras once its IMUs are aligned.

    From then on headings drift. The root moves with the standing foot if both legs have IMUs, and
    stays where it is otherwise. There is no pose while the cameras are used.
    """

    COUNTERS = (*DefaultEstimator.COUNTERS, "frames_of_cameras_unused")
    ALIGNS_IMUS = False  # only by what its own start has seen
    _is_alone = False

    def _is_known(self, state: FilterState, ahead_s: float = 0.0) -> bool:
        """Whether the filter does without the cameras; there is no pose while it uses them."""
        del state, ahead_s
        return self._is_alone and self._has_aligned

    def _uses_cameras(self, segments: Sequence[str]) -> bool:
        """Use the cameras until every IMU is aligned or its time is over, or if none is left."""
        uses = [use for use in self.imu_uses if use.has_link]
        aligned = [use.aligned_ns for use in uses if use.is_aligned and use.aligned_ns is not None]
        if not aligned:  # or none any more, because the IMUs restarted
            self._is_alone = False
        elif not self._is_alone:
            waited_ns = self._history.stamp_ns - min(aligned)
            if waited_ns > STILL_NS:
                uses = [use for use in uses if use.has_moved and use.segment in segments]
            are_aligned = all(use.is_aligned for use in uses)
            self._is_alone = are_aligned or waited_ns > WARM_UP_NS
            if self._is_alone and self._filter.state is not None:
                self._filter.state.pose.velocity[:] = 0.0
                self._output.information[CAMERAS] = 0.0
        if self._is_alone:
            self.counters.add("frames_of_cameras_unused")
        return not self._is_alone
