"""``imu``: the IMUs alone, aligned by the cameras at the start and left to themselves then."""

from typing import ClassVar

from pose_core.estimators.default import DefaultEstimator
from pose_core.fusion.observation import Observation
from pose_core.fusion.pose_block import TimedPose
from pose_core.imu.imu_history import ImuStates
from pose_core.kernels.joint_angle_extraction import StateNumbers
from pose_core.stamps import NS_PER_S

WARM_UP_NS = 30 * NS_PER_S  # after the first IMU is aligned, the others are not waited for


class ImuEstimator(DefaultEstimator):
    """The default estimator that looks at no camera once its IMUs are aligned.

    Headings drift from then on, as they do without cameras; the root stays where it was. Before an
    IMU is aligned, and where there is none, there is no pose.
    """

    COUNTERS: ClassVar[tuple[str, ...]] = (
        *DefaultEstimator.COUNTERS,
        "frames_of_cameras_unused",
    )
    _is_alone = False

    def update(self, observation: Observation) -> StateNumbers | None:
        """One step; None while the cameras alone give the pose."""
        state = super().update(observation)
        return state if self._has_aligned else None

    def predicted(self, stamp_ns: int, readings: ImuStates) -> TimedPose | None:
        """The pose at a later instant; None while the cameras alone give the pose."""
        return super().predicted(stamp_ns, readings) if self._has_aligned else None

    @property
    def _has_aligned(self) -> bool:
        return any(use.is_aligned for use in self.imu_uses)

    def _uses_camera(self, sensor: int) -> bool:
        """Use cameras until every IMU is aligned, or has had its time; again when none is."""
        del sensor
        uses = [use for use in self.imu_uses if use.is_known]
        aligned = [use.aligned_ns for use in uses if use.is_aligned and use.aligned_ns is not None]
        if not aligned:  # or none any more: their worlds have begun anew
            self._is_alone = False
        elif not self._is_alone:
            waited_ns = self._stamp_ns - min(aligned)
            self._is_alone = len(aligned) == len(uses) or waited_ns > WARM_UP_NS
            if self._is_alone and self._state is not None:
                self._state.pose.velocity[:] = 0.0
        if self._is_alone:
            self.counters.add("frames_of_cameras_unused")
        return not self._is_alone
