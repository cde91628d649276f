"""``default``: rotations of the body's links on the manifold, every sensor's frame as it comes."""

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from pose_core.body.inverse_kinematics import dof_from_positions
from pose_core.body.kinematics import ForwardKinematics
from pose_core.body.model import BodyModel
from pose_core.body.segment_tree import SegmentTree
from pose_core.body.shape import BodyShape
from pose_core.body.trunk import trunk_axes
from pose_core.counters import Counters
from pose_core.estimators.estimator import Estimator
from pose_core.estimators.kinect_tracker import mean_of_sensors
from pose_core.estimators.lost_limbs import limb_numbers
from pose_core.filters.segment_filter import NO_IMUS, SegmentFilter, empty_pose
from pose_core.filters.segment_state import SegmentState
from pose_core.fusion.observation_block import ObservationBlock
from pose_core.fusion.parameters import FusionParameters
from pose_core.fusion.pose_block import PoseBlock, StateBlock, TimedPose
from pose_core.imu.readings import SegmentReadings
from pose_core.joints import JOINTS
from pose_core.kernels import following as kernel
from pose_core.kernels.compiling import settled
from pose_core.kernels.fit import FITTING, scale_of
from pose_core.kernels.following import Known, Rules, Seen
from pose_core.kernels.gliding import Glide
from pose_core.kernels.handover import glide_after, make_handover
from pose_core.kernels.links import ImuTrust, LinkLooks, trust_readings
from pose_core.kernels.reading import StateNumbers
from pose_core.kernels.sources import NEVER
from pose_core.kernels.telling import keep
from pose_core.stamps import NS_PER_S
from pose_core.streams.samples import FloatArray

IMU_FRAMES = 10.0  # [-] an IMU's errors are slow: so many samples count as one
GYRO_STDDEV = 0.05  # [rad/s] beside the segment's soft tissue
HELD_JERK = 100.0  # [rad/s³] of a limb that swings, while its IMU's reading is only carried on
COUNTED = {
    "frames_too_late": kernel.FRAMES_TOO_LATE,
    "frames_late_but_used": kernel.FRAMES_LATE,
    "limbs_reopened": kernel.LIMBS_REOPENED,
    "limbs_turned_back": kernel.TURNED_BACK,
    "sides_swapped": kernel.SIDES_SWAPPED,
}


class SegmentEstimator(Estimator):
    """Feeds a :class:`SegmentFilter`; its poses are that filter's states."""

    COUNTERS = (
        "filter_starts",
        "filter_restarts_gap",
        "filter_restarts_strayed",
        "filter_restarts_numerical",
        "frames_without_trunk",
        *COUNTED,
    )
    BODY_MODEL: ClassVar[str] = "default"
    NEEDS_ALIGNED_FRAMES: ClassVar[bool] = False
    CAN_PREDICT: ClassVar[bool] = True
    LOOKS_AT_CAMERAS: ClassVar[bool] = True
    """Whether it does so after its first pose."""

    def __init__(
        self,
        model: BodyModel,
        shape: BodyShape,
        parameters: FusionParameters,
        counters: Counters,
    ) -> None:
        super().__init__(model, shape, parameters, counters)
        tree = SegmentTree(model, shape)
        self._filter = SegmentFilter(tree)
        sensors, links = len(parameters.sensors), len(tree.parents)
        limbs = limb_numbers(model)
        self._rules = Rules(
            expected=self._filter.expectations,
            motion=self._filter.motion_numbers,
            parents=tree.parents,
            limbs=limbs,
            forget_after_s=float(parameters.forget_after),
            tracker_delay_s=float(parameters.tracker_delay),
            cameras=sensors if self.LOOKS_AT_CAMERAS else 0,
        )
        size = self._filter.layout.size
        self._known = Known(
            pose=empty_pose(self._filter.layout),  # as long as there is no state
            P=np.empty((size, size)),
            memory=self._filter.memory,
            predicted=self._filter.predicted,
            shown=empty_pose(self._filter.layout),
            handover=make_handover(links),
            instants_ns=np.array([0, NEVER]),
            heard_ns=np.full(sensors + links, NEVER),
            far_since_ns=np.full(len(limbs.joints), NEVER),
            distance=np.empty(len(JOINTS)),
            fit=np.full(1, FITTING),
            last=np.full(2, np.nan),
            counts=np.zeros(kernel.COUNTS, np.int64),
        )
        self._follow, self._keep = settled(kernel.follow), settled(keep)
        self._trust = settled(trust_readings)
        names = model.link_names
        self._link_of = {name: names.index(link) for name, link in model.segments.items()}
        self._links_asked: dict[tuple[str, ...], NDArray[np.int64]] = {}
        self._imu_trust = ImuTrust(
            mounting=float(parameters.imu_mounting_stddev),
            frames=IMU_FRAMES,
            gyro=GYRO_STDDEV,
            held_jerk=HELD_JERK,
        )
        self._last_told: NDArray[np.uint8] | None = None  # the tracking state of that frame

    def track(self, block: ObservationBlock) -> PoseBlock | None:
        """Predict to the instants and take everything that is known of them."""
        seen, length = self._seen(block), len(block.stamps_ns)
        out, told = self._room(length), np.empty(length, np.int64)
        row, count, begins = 0, 0, kernel.GOING_ON
        while row < length:
            is_known = self._filter.state is not None
            ended, row, count = self._follow(
                self._rules, seen, self._known, out, told, row, count, begins, is_known
            )
            if ended == kernel.FOLLOWED:
                break
            seen_to = self._see_to(ended, block.positions[row])
            if seen_to is None:
                row, begins = row + 1, kernel.GOING_ON
            else:
                begins = seen_to
        self._count()
        if not count:
            return None
        rows = slice(None) if count == length else told[:count]
        tracking_state = block.tracking_state[rows]
        self._last_told = tracking_state[-1]
        return StateBlock(
            stamps_ns=block.stamps_ns[rows],
            newest_ns=block.newest_ns[rows],
            tracking_state=tracking_state,
            states=StateNumbers(*(each[:count] for each in out)),
        )

    def predicted(self, stamp_ns: int, readings: SegmentReadings) -> TimedPose | None:
        """The state gone on to the instant; what the IMUs say of it counts already."""
        ahead_s = (stamp_ns - int(self._known.instants_ns[kernel.FILTER])) / NS_PER_S
        if self._filter.state is None or self._last_told is None:
            return None
        if not 0.0 <= ahead_s < self.parameters.forget_after:
            return None
        ahead = self._filter.ahead(ahead_s)
        information = np.zeros((2, len(self._rules.parents), 3, 3))
        if len(readings):
            links = self._links_of(readings.segments)
            try:
                report = ahead.update(imus=known_links(self._trusted(readings, links)))
            except np.linalg.LinAlgError:
                return None
            information = report.information
        glide, scale = glide_after(self._known.handover, ahead_s), scale_of(self._known.fit)
        pose = self._kept(ahead.known_state, glide, information, scale)
        return TimedPose(stamp_ns=stamp_ns, tracking_state=self._last_told, pose=pose)

    def _see_to(self, ended: int, positions: FloatArray) -> int | None:
        """What following has stopped at; how the observation begins then, None: it is left out.

        Args:
            ended: How following has ended.
            positions: Of the observation, (sensors, 15, 3) [m].
        """
        shown = self._filter.state
        if ended == kernel.BROKEN:
            self.counters.add("filter_restarts_numerical")
            self._filter.state = None
            return None
        if ended == kernel.STRAYED:
            self.counters.add("filter_restarts_strayed")
            self._start(positions)
            return kernel.STRAYED_FROM
        if shown is not None:
            self.counters.add("filter_restarts_gap")
        if not self._start(positions):
            return None
        if shown is None:
            return kernel.STARTED
        self._known = self._known._replace(shown=shown.pose)
        return kernel.STARTED_ANEW

    def _start(self, positions: FloatArray) -> bool:
        """Begin with the pose that the cameras' mean shows, if it shows the trunk."""
        mean = mean_of_sensors(positions)
        if not np.all(np.isfinite(trunk_axes(mean))):
            self.counters.add("frames_without_trunk")
            return False
        self.counters.add("filter_starts")
        kinematics = ForwardKinematics(self.model, self.shape.offsets, trunk_axes(mean))
        dof = dof_from_positions(self.model, mean)
        self._filter.start(kinematics.pose(dof).rotations, dof[:3])
        state = self._filter.known_state
        self._known = self._known._replace(pose=state.pose, P=state.covariance)
        return True

    def _count(self) -> None:
        """Bring what the kernels have counted to the counters."""
        counts = self._known.counts
        if counts.any():
            for name, index in COUNTED.items():
                self.counters.add(name, int(counts[index]))
            counts[:] = 0

    def _kept(
        self, state: SegmentState, glide: Glide, information: FloatArray, scale: float
    ) -> StateNumbers:
        """What of a state is told.

        Args:
            state: Of the filter, which goes on.
            glide: What still lies between it and what goes out.
            information: Of the sources on each link, see :class:`StateNumbers`.
            scale: Of the variances [-].
        """
        kept = StateNumbers(*(each[0] for each in self._room(1)))
        kept = kept._replace(information=information)
        self._keep(state.pose, state.covariance, self._rules.parents, glide, scale, kept)
        return kept

    def _room(self, length: int) -> StateNumbers:
        """Room for what of so many states is told."""
        links = len(self._rules.parents)
        return StateNumbers(
            position=np.empty((length, 3)),
            velocity=np.empty((length, 3)),
            rotations=np.empty((length, links, 3, 3)),
            rates=np.empty((length, links, 3)),
            turns=np.empty((length, links, 3)),
            shift=np.empty((length, 3)),
            place_variance=np.empty((length, 3)),
            covariance=np.empty((length, links, 3, 3)),
            information=np.empty((length, 2, links, 3, 3)),
            scale=np.empty((length, 1)),
        )

    def _seen(self, block: ObservationBlock) -> Seen:
        """The block as the kernels want it: its IMUs as links, those that the model knows."""
        counts, imus = [0], NO_IMUS
        for segments in block.segments:
            counts.append(counts[-1] + len(segments))
        first = np.array(counts, np.int64)
        if counts[-1]:
            each = [self._links_of(segments) for segments in block.segments]
            imus = self._trusted(block, each[0] if len(each) == 1 else np.concatenate(each))
            if imus.links.min() < 0:
                first = np.concatenate([[0], np.cumsum(imus.links >= 0)])[first]
                imus = known_links(imus)
        return Seen(
            block.stamps_ns,
            block.positions,
            block.tracking_state,
            block.cameras,
            block.offsets,
            first,
            imus,
        )

    def _trusted(
        self, readings: SegmentReadings | ObservationBlock, links: NDArray[np.int64]
    ) -> LinkLooks:
        """What IMUs say of these links, and what it is worth."""
        count = len(links)
        variance, rate_variance = np.empty((count, 3)), np.empty(count)
        self._trust(readings.stddev, readings.age_s, self._imu_trust, variance, rate_variance)
        R, rate = readings.R_map_segment, readings.angular_velocity
        return LinkLooks(links, R, variance, rate, rate_variance)

    def _links_of(self, segments: tuple[str, ...]) -> NDArray[np.int64]:
        """The links that segments are, −1 where the model knows none."""
        links = self._links_asked.get(segments)
        if links is None:
            links = np.array([self._link_of.get(segment, -1) for segment in segments], np.int64)
            self._links_asked[segments] = links
        return links


def known_links(looks: LinkLooks) -> LinkLooks:
    """Those of them that the model knows."""
    known = looks.links >= 0
    return LinkLooks(
        looks.links[known],
        looks.R_map_link[known],
        looks.variance[known],
        looks.angular_velocity[known],
        looks.rate_variance[known],
    )
