"""``default``: rotations of the body's links on the manifold, every sensor's frame as it comes."""

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from pose_common.counters import Counters
from pose_common.joints import JOINTS
from pose_common.stamps import NS_PER_S
from pose_fusion.body.inverse_kinematics import dof_from_positions
from pose_fusion.body.kinematics import ForwardKinematics
from pose_fusion.body.model import BodyModel
from pose_fusion.body.segment_tree import SegmentTree
from pose_fusion.body.shape import BodyShape
from pose_fusion.body.trunk import trunk_axes
from pose_fusion.filters.looks import Outcome
from pose_fusion.filters.segment_filter import (
    NO_IMUS,
    CameraLooks,
    LinkLooks,
    SegmentFilter,
    UpdateReport,
)
from pose_fusion.filters.segment_state import SegmentState
from pose_fusion.fusion.estimators.estimator import Estimator, Observation, TimedPose
from pose_fusion.fusion.estimators.handover import Handover, Sources
from pose_fusion.fusion.estimators.kinect_tracker import mean_of_sensors
from pose_fusion.fusion.estimators.lost_limbs import LostLimbs
from pose_fusion.fusion.estimators.uncertainty import Fit, scale_of
from pose_fusion.fusion.parameters import FusionParameters
from pose_fusion.imu.readings import SegmentReadings
from pose_fusion.kernels.compiling import settled
from pose_fusion.kernels.gliding import Glide
from pose_fusion.kernels.links import ImuTrust, trust_readings
from pose_fusion.kernels.placing import Pose
from pose_fusion.kernels.reading import StateNumbers
from pose_fusion.kernels.telling import keep

LATEST_S = 0.2  # [s] a frame that is later says too little of now
JUMP_BACK_S = 1.0  # [s] further back than this, a recording has begun anew
IMU_FRAMES = 10.0  # [-] an IMU's errors are slow: so many samples count as one
GYRO_STDDEV = 0.05  # [rad/s] beside the segment's soft tissue
HELD_JERK = 100.0  # [rad/s³] of a limb that swings, while its IMU's reading is only carried on


class SegmentEstimator(Estimator):
    """Feeds a :class:`SegmentFilter`; its poses are that filter's states."""

    COUNTERS = (
        "filter_starts",
        "filter_restarts_gap",
        "filter_restarts_strayed",
        "filter_restarts_numerical",
        "frames_without_trunk",
        "frames_too_late",
        "frames_late_but_used",
        "limbs_reopened",
        "limbs_turned_back",
        "sides_swapped",
    )
    BODY_MODEL: ClassVar[str] = "default"
    NEEDS_ALIGNED_FRAMES: ClassVar[bool] = False
    CAN_PREDICT: ClassVar[bool] = True

    def __init__(
        self,
        model: BodyModel,
        shape: BodyShape,
        parameters: FusionParameters,
        counters: Counters,
    ) -> None:
        super().__init__(model, shape, parameters, counters)
        self._tree = SegmentTree(model, shape)
        self._filter = SegmentFilter(self._tree)
        self._keep = settled(keep)
        self._handover = Handover(len(self._tree.parents))
        self._sources = Sources()
        names = model.link_names
        self._link_of = {name: names.index(link) for name, link in model.segments.items()}
        self._links_asked: dict[tuple[str, ...], tuple[NDArray[np.int64], bool]] = {}
        self._imu_trust = ImuTrust(
            mounting=float(parameters.imu_mounting_stddev),
            frames=IMU_FRAMES,
            gyro=GYRO_STDDEV,
            held_jerk=HELD_JERK,
        )
        self._lost = LostLimbs(model)
        self._fit = Fit()
        self._stamp_ns = 0
        self._last: Observation | None = None  # that a pose has gone out for

    def update(self, observation: Observation) -> StateNumbers | None:
        """Predict to the instant and take everything that is known of it."""
        report, state = self._take(observation), self._filter.state
        if report is None or state is None:
            return None
        self._last = observation
        return self._kept(state, self._handover.show(), report, scale_of(self._fit.distance))

    def _take(self, observation: Observation) -> UpdateReport | None:
        """Bring the filter to the observation's instant; None if there is no new pose to tell."""
        ahead_s = (observation.stamp_ns - self._stamp_ns) / NS_PER_S
        if -JUMP_BACK_S < ahead_s < -LATEST_S:
            self.counters.add("frames_too_late")
            return None
        shown = self._filter.state
        is_new = ahead_s <= -JUMP_BACK_S or ahead_s >= self.parameters.forget_after
        if shown is not None and is_new and not observation.readings:
            self.counters.add("filter_restarts_gap")
            self._filter.state = None
        if self._filter.state is None:
            if not self._start(observation):
                self._filter.state = shown
                return None
        elif ahead_s > 0.0:
            self._filter.predict(ahead_s)
        self._handover.predict(min(max(ahead_s, 0.0), self.parameters.forget_after))
        self._stamp_ns = max(self._stamp_ns, observation.stamp_ns)
        if ahead_s <= -JUMP_BACK_S:
            self._stamp_ns = observation.stamp_ns
        report = self._correct(observation, max(-ahead_s, 0.0), shown)
        if report is None or self._filter.state is None:
            return None
        if -JUMP_BACK_S < ahead_s < 0.0:
            self.counters.add("frames_late_but_used")  # its instant has been told already
            return None
        self._fit.note(max(ahead_s, 0.0), report.outcome.typical)
        return report

    def predicted(self, stamp_ns: int, readings: SegmentReadings) -> TimedPose | None:
        """The state gone on to the instant; what the IMUs say of it counts already."""
        state, last = self._filter.state, self._last
        ahead_s = (stamp_ns - self._stamp_ns) / NS_PER_S
        if state is None or last is None or not 0.0 <= ahead_s < self.parameters.forget_after:
            return None
        ahead = self._filter.ahead(ahead_s)
        report = nothing_seen(self._tree)
        if len(readings):
            try:
                report = ahead.update(imus=self._imu_looks(readings))
            except np.linalg.LinAlgError:
                return None
        glide, scale = self._handover.ahead(ahead_s), scale_of(self._fit.distance)
        pose = self._kept(ahead.known_state, glide, report, scale)
        return TimedPose(stamp_ns=stamp_ns, tracking_state=last.tracking_state, pose=pose)

    def _kept(
        self, state: SegmentState, glide: Glide, report: UpdateReport, scale: float
    ) -> StateNumbers:
        """What of a state is told.

        Args:
            state: Of the filter, which goes on.
            glide: What still lies between it and what goes out.
            report: Of the update that led to it.
            scale: Of the variances [-].
        """
        links = len(state.rotations)
        kept = StateNumbers(
            position=np.empty(3),
            velocity=np.empty(3),
            rotations=np.empty((links, 3, 3)),
            rates=np.empty((links, 3)),
            turns=np.empty((links, 3)),
            shift=np.empty(3),
            place_variance=np.empty(3),
            covariance=np.empty((links, 3, 3)),
            information=report.information,
            scale=np.empty(1),
        )
        self._keep(state.pose, state.covariance, self._tree.parents, glide, scale, kept)
        return kept

    def _correct(
        self, observation: Observation, late_s: float, shown: SegmentState | None
    ) -> UpdateReport | None:
        """Update the filter; what went out before glides to it.

        Args:
            observation: What is seen.
            late_s: How far before the filter's instant it was seen [s].
            shown: The state that went out last, if the filter has just started anew.
        """
        state = self._filter.state
        if state is None:
            return None
        imus = self._imu_looks(observation.readings)
        # How late the trackers are matters where rates are known: by gyroscopes.
        delay_s = late_s + (self.parameters.tracker_delay if len(imus.links) else 0.0)
        try:
            report = self._filter.update(self._camera_looks(observation, delay_s), imus)
        except np.linalg.LinAlgError:
            self.counters.add("filter_restarts_numerical")
            self._filter.state = None
            return None
        outcome = report.outcome
        if outcome.flipped or outcome.swapped:
            self.counters.add("limbs_turned_back", outcome.flipped)
            self.counters.add("sides_swapped", outcome.swapped)
        lost = self._lost.check(observation.stamp_ns, report.distance, outcome.farthest)
        if lost is None:
            self.counters.add("filter_restarts_strayed")
            self._start(observation)
        elif lost:
            self.counters.add("limbs_reopened")
            self._filter.reopen(lost)
        eventful = self._sources.is_eventful(
            self._stamp_ns, _names(observation), lost != [] or shown is not state
        )
        before: Pose | None = self._filter.predicted
        if shown is not state:  # the filter has started, maybe anew
            before = None if shown is None else shown.pose
        self._handover.follow(before, (self._filter.state or state).pose, eventful)
        return report

    def _start(self, observation: Observation) -> bool:
        """Begin with the pose that the cameras' mean shows, if it shows the trunk."""
        mean = mean_of_sensors(observation.positions)
        if not np.all(np.isfinite(trunk_axes(mean))):
            self.counters.add("frames_without_trunk")
            return False
        self.counters.add("filter_starts")
        kinematics = ForwardKinematics(self.model, self.shape.offsets, trunk_axes(mean))
        dof = dof_from_positions(self.model, mean)
        self._filter.start(kinematics.pose(dof).rotations, dof[:3])
        return True

    def _camera_looks(self, observation: Observation, delay_s: float) -> CameraLooks:
        """What the cameras say of the observation's instant, ``delay_s`` [s] ago."""
        return CameraLooks(
            observation.positions,
            observation.tracking_state,
            observation.cameras,
            observation.offsets,
            float(delay_s),
        )

    def _imu_looks(self, readings: SegmentReadings) -> LinkLooks:
        """What the IMUs say of the model's links."""
        count = len(readings)
        if not count:
            return NO_IMUS
        links, are_known = self._links_of(readings.segments)
        R, rate = readings.R_map_segment, readings.angular_velocity
        variance, rate_variance = np.empty((count, 3)), np.empty(count)
        trust_readings(readings.stddev, readings.age_s, self._imu_trust, variance, rate_variance)
        if are_known:
            return LinkLooks(links, R, variance, rate, rate_variance)
        known = links >= 0
        return LinkLooks(links[known], R[known], variance[known], rate[known], rate_variance[known])

    def _links_of(self, segments: tuple[str, ...]) -> tuple[NDArray[np.int64], bool]:
        """The links that segments are, −1 where the model knows none; and whether it knows all."""
        asked = self._links_asked.get(segments)
        if asked is None:
            links = np.array([self._link_of.get(segment, -1) for segment in segments], np.int64)
            asked = self._links_asked[segments] = links, bool((links >= 0).all())
        return asked


def nothing_seen(tree: SegmentTree) -> UpdateReport:
    """The report of an instant of which nothing is known."""
    return UpdateReport(
        outcome=Outcome(is_definite=True, flipped=0, swapped=0, typical=np.nan, farthest=np.nan),
        distance=np.full(len(JOINTS), np.nan),
        information=np.zeros((2, len(tree.parents), 3, 3)),
    )


def _names(observation: Observation) -> list[str]:
    """The cameras, by number, and the segments' IMUs that speak of an instant."""
    states = observation.tracking_state.tolist()
    cameras = [str(camera) for camera, of_joints in enumerate(states) if any(of_joints)]
    return [*cameras, *observation.readings.segments]
