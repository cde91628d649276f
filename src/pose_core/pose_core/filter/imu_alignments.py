"""Sensor-to-segment alignment of all IMUs of one body, with the state of each."""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from pose_core.body.model import BodyModel
from pose_core.estimates.observation import Observation
from pose_core.filter.frame import CameraFrame
from pose_core.filter.imu import NO_IMUS, ImuFrame
from pose_core.filter.imu_place_checks import ImuPlaceChecks
from pose_core.filter.imu_state import (
    CONTRADICTED_S,
    RESTRAPPED_NS,
    after_gap,
    alignment_of,
    is_contradicted,
    must_be_realigned,
    north_of,
)
from pose_core.filter.layout import rotation_column
from pose_core.filter.state import IMU_STATES, FilterState, forget_imu, with_imu, with_shared_offset
from pose_core.filter.tuning import FilterTuning
from pose_core.filter.worn_imus import WornImu, WornImus
from pose_core.imu.angular_velocity_check import REPLACED_STDDEV
from pose_core.imu.heading_walk import SOUND
from pose_core.imu.imu_history import ImuMeasurements
from pose_core.imu.imu_use import ImuUse
from pose_core.imu.sensor_alignment import MIN_UNKNOWN_HEADING_STDDEV, Alignment
from pose_core.imu.sensor_to_segment import SensorToSegment
from pose_core.imu.z_down_vote import MAX_VOTE, imus_to_turn_over
from pose_core.joints import JOINT_INDEX, LIMB_ENDS
from pose_core.stamps import NS_PER_S

SOLVE_PERIOD_NS = NS_PER_S // 2
MISLED_STDDEV = 1.0  # [rad] of the link that such an IMU has turned
MAX_STEP_S = 0.1  # [s] upper bound of the time assigned to one instant
COVARIANCE_FACTOR = 0.7  # [-] of an alignment's covariance passed to the filter
SYSTEMATIC_STDDEV = np.radians([2.3, 2.3, 3.5, 3.0])
"""[rad] of sensor-to-segment rotation and heading by trackers' offsets and soft tissue, which the
filter takes for noise; as measured on captured motion (docs/accuracy/imus.md)."""
WALK_SHARE = 0.7  # [-] of a heading's measured walk that its state walks, because fields return


class ImuAlignments:
    """Aligns each IMU with its link and passes the aligned ones' measurements to the filter.

    Args:
        model: The body model, which gives the segments' links.
        tuning: Contains the IMUs' noise and the joints' shared offsets.
    """

    def __init__(self, model: BodyModel, tuning: FilterTuning) -> None:
        self._model = model
        self._shared_offset_variance = tuning.camera.shared_offset_stddev**2
        self._imus = WornImus(model, tuning.imu.spine_bend)
        self._places = ImuPlaceChecks(self._imus)
        self._sensor_to_segment: dict[str, SensorToSegment] = {}
        self._instants = 0
        self.changes = 0
        """How often alignments have been added or dropped so far."""
        self.z_down: frozenset[str] = frozenset()
        """Segments whose IMU's reference frame has a z axis that points down (NED)."""
        self._observed_ns: int | None = None
        self._solved_ns: int | None = None

    @property
    def uses(self) -> tuple[ImuUse, ...]:
        """State of each IMU with samples, sorted by segment."""
        for worn in self._imus:
            worn.use.frames = self._instants
        return tuple(worn.use for worn in self._imus)

    def use_sensor_to_segment(self, alignments: Mapping[str, SensorToSegment]) -> None:
        """Use alignments of a calibration; headings are still estimated from motion."""
        self._sensor_to_segment = dict(alignments)
        self._place_as_known(alignments)

    def sensor_to_segment(self, state: FilterState) -> dict[str, SensorToSegment]:
        """The filter's estimate of each aligned IMU's alignment, by segment."""
        return {
            worn.use.segment: self._alignment_of(worn, state)
            for worn in self._imus
            if worn.use.is_aligned
        }

    def restart(self, *, discard: bool = False) -> None:
        """Reset the alignments for a new filter.

        Args:
            discard: Whether to discard the measurements, which were of a wrong state, and what
                they told.
        """
        self.changes += 1
        self._observed_ns = None
        self._places.restart_slips()
        for worn in self._imus:
            worn.use.is_aligned = False
            if discard:
                worn.former_alignment = None
        if discard:
            self._places.restart_exchanges()
            self._place_as_known([worn.use.segment for worn in self._imus])

    def _place_as_known(self, segments: Iterable[str]) -> None:
        """Take these IMUs to be where a calibration says, or on their own segments, z upwards.

        Their measurements so far are discarded.
        """
        known = self._sensor_to_segment
        self.z_down = frozenset(name for name, each in known.items() if each.z_down)
        for segment in segments:
            there = known[segment].exchanged_with if segment in known else ""
            self._imus.wear(segment, there or segment)

    def register(
        self, stamp_ns: int, imus: ImuMeasurements, state: FilterState
    ) -> list[tuple[int, float]]:
        """Register measurements; an IMU that slipped or restarted is realigned.

        Args:
            stamp_ns: The instant [ns].
            imus: Measurements of all IMUs.
            state: State of the filter before the update.

        Returns:
            The walks of headings that were added to P: columns, and variances [rad²].
        """
        self._instants += 1
        walks = []
        says_north = (imus.stddev[:, 2] < MIN_UNKNOWN_HEADING_STDDEV).tolist()
        for row, worn in self._imus.with_link(imus.segments):
            self._slip_as_known(stamp_ns, worn, state)
            if stamp_ns < worn.slipping_until_ns:
                worn.slips = imus.slips.get(worn.use.segment, 0)
            if worn.has_slipped(imus):
                worn.slips = imus.slips[worn.use.segment]
                self._discard(worn, state)
                self._undo_exchange(worn, state)
            worn.use.frames_used += worn.use.is_aligned
            if not worn.use.has_moved:
                worn.note_orientation(imus.R_world_sensor[row])
            worn.says_north = says_north[row]
            gap_ns = 0 if worn.last_ns is None else stamp_ns - worn.last_ns
            worn.last_ns = stamp_ns
            if worn.use.is_aligned and worn.use.segment in imus.heading_walks:
                walk = WALK_SHARE * (imus.heading_walks[worn.use.segment] - SOUND)
                heading = state.imus.column[worn.link] + 3
                walks.append((int(heading), walk**2 * max(gap_ns, 0) / NS_PER_S))
                state.P[heading, heading] += walks[-1][1]
            if must_be_realigned(worn, gap_ns, imus.R_world_sensor[row], self._imus, state):
                if worn.use.is_aligned:
                    worn.former_alignment = after_gap(self._alignment_of(worn, state), gap_ns)
                    worn.may_be_restrapped = gap_ns > RESTRAPPED_NS
                self._exclude(worn, state)
        return walks

    def frame(self, imus: ImuMeasurements) -> ImuFrame:
        """Measurements of the aligned IMUs for the filter."""
        aligned = [each for each in self._imus.with_link(imus.segments) if each[1].use.is_aligned]
        if imus.slips:
            aligned = [each for each in aligned if not each[1].has_slipped(imus)]
        if not aligned:
            return NO_IMUS
        rate_stddev = np.zeros(len(aligned))
        if imus.replaced_rates:
            is_replaced = [worn.use.segment in imus.replaced_rates for _, worn in aligned]
            rate_stddev[is_replaced] = REPLACED_STDDEV
        are_all = len(aligned) == len(imus)
        chosen = slice(None) if are_all else np.array([row for row, _ in aligned])
        return ImuFrame(
            np.array([worn.link for _, worn in aligned]),
            imus.R_world_sensor[chosen],
            imus.angular_velocity[chosen],
            imus.age_s[chosen],
            rate_stddev,
        )

    def observe(
        self, observation: Observation, frames: Sequence[CameraFrame], state: FilterState
    ) -> FilterState:
        """Collect one instant for the alignment; returns the state with newly aligned IMUs.

        Args:
            observation: Measurements of all IMUs, and the cameras' frame.
            frames: Its frames in map, with swapped sides exchanged.
            state: State of the filter after the update with them.
        """
        stamp_ns, imus = observation.stamp_ns, observation.imus
        self._places.add_to_exchanges(observation, frames)
        self.add_to_slips(observation, frames, state)
        before_ns, self._observed_ns = self._observed_ns, stamp_ns
        if before_ns is None or stamp_ns < before_ns:
            self._solved_ns = stamp_ns
            return state
        dt_s = min((stamp_ns - before_ns) / NS_PER_S, MAX_STEP_S)
        for row, worn in self._imus.with_link(imus.segments):
            if worn.use.is_aligned:
                if is_contradicted(worn, self._imus, self._model.parents, state):
                    self._exclude_contradicted(worn, state)
            elif stamp_ns < worn.slipping_until_ns:
                self._places.restart_exchanges()
            else:
                first = rotation_column(worn.link)
                block = slice(first, first + 3)
                worn.alignment.observe(
                    dt_s,
                    imus.R_world_sensor[row],
                    state.pose.rotations[worn.link],
                    state.P[block, block],
                    state.pose.rates[worn.link],
                )
        if stamp_ns - (self._solved_ns or 0) >= SOLVE_PERIOD_NS:
            self._solved_ns = stamp_ns
            state = self._solve(stamp_ns, imus.segments, state)
        return state

    def add_to_slips(
        self, observation: Observation, frames: Sequence[CameraFrame], state: FilterState
    ) -> None:
        """Add one instant, or a late frame, to the check for slips; see :meth:`observe`."""
        self._places.add_to_slips(observation, frames, state.imus.heading)

    def _exclude_contradicted(self, worn: WornImu, state: FilterState) -> None:
        """Exclude an IMU that the cameras contradict: it has turned its link with it."""
        self._discard(worn, state)
        worn.alignment.require_better_fit()
        first = rotation_column(worn.link)
        turned = np.arange(first, first + 3)
        state.P[turned, turned] += MISLED_STDDEV**2
        self._undo_exchange(worn, state)

    def _solve(self, stamp_ns: int, segments: tuple[str, ...], state: FilterState) -> FilterState:
        """Align IMUs with sufficient motion; store the uncertainty of the others."""
        exchanged = self._places.exchanges.exchanged()
        for worn in self._imus:
            if worn.segment in exchanged:
                there = exchanged[worn.segment]
                if worn.use.has_link:
                    self._exclude(worn, state)
                self._discard_known(worn)
                self.z_down -= {worn.use.segment}  # as found on the other's segment
                self._imus.wear(worn.use.segment, there)
        if exchanged:
            self._places.restart_exchanges()
        self._find_z_down(state)
        slipped = self._places.slips.slipped
        for _, worn in self._imus.with_link(segments):
            if worn.segment in slipped:
                self._discard(worn, state)
                self._places.restart_exchanges()
            if not worn.use.is_aligned:
                found = self._aligned(worn, state)
                if found is None:
                    continue
                worn.use.note_aligned(stamp_ns)
                self.changes += 1
                covariance = COVARIANCE_FACTOR * found.covariance
                state = with_imu(state, worn.link, found.R_sensor_link, found.heading, covariance)
                if worn.segment in LIMB_ENDS:
                    far = JOINT_INDEX[LIMB_ENDS[worn.segment][1]]
                    state = with_shared_offset(state, far, self._shared_offset_variance)
            column = int(state.imus.column[worn.link])
            filtered = np.maximum(np.diag(state.P)[column : column + IMU_STATES], 0.0)
            worn.use.noise = float(state.imus.noise[worn.link])
            worn.use.heading_drift = float(state.imus.drift[worn.link])
            worn.use.note_variance(filtered + SYSTEMATIC_STDDEV**2)
        return state

    def _find_z_down(self, state: FilterState) -> None:
        """Turn IMUs over whose z axes point down."""
        upright = {imu.use.segment: imu for imu in self._imus if imu.use.segment not in self.z_down}
        for worn in upright.values():
            if not worn.use.is_aligned:
                worn.alignment.compare_z_down()
        leads = {
            segment: -MAX_VOTE if worn.use.is_aligned else worn.alignment.z_down_lead
            for segment, worn in upright.items()
        }
        found = imus_to_turn_over(leads, self.z_down)
        for segment in found:
            worn = upright[segment]
            if worn.use.is_aligned:
                self._exclude(worn, state)
            worn.alignment.turn_over()
            self._discard_known(worn)
        if found:
            self.z_down |= found
            self._places.restart_exchanges()

    def _aligned(self, worn: WornImu, state: FilterState) -> Alignment | None:
        """The alignment of an IMU, with its known one, or without that if it fails."""
        known = worn.former_alignment or self._sensor_to_segment.get(worn.use.segment)
        if known is None and not worn.use.has_moved:
            return None
        north = north_of(worn, self._imus, state)
        is_doubtful = worn.former_alignment is not None and worn.may_be_restrapped
        found = worn.alignment.solve(known, north, is_doubtful=is_doubtful)
        worn.use.does_not_fit = worn.alignment.does_not_fit
        if known is None or found is not None:
            return found
        anew = None if worn.former_alignment is None else worn.alignment.solve(None, north)
        if anew is not None or worn.use.does_not_fit:  # it has been strapped on anew since
            worn.use.contradictions += 1
            self._discard_known(worn)
        return anew

    def _discard(self, worn: WornImu, state: FilterState) -> None:
        """Discard an IMU's alignment after it slipped."""
        worn.use.contradictions += 1
        worn.require_motion()
        self._discard_known(worn)
        state.imus.contradicted_s[worn.link] = 0.0
        self._exclude(worn, state)

    def _undo_exchange(self, worn: WornImu, state: FilterState) -> None:
        """Take exchanged IMUs to be on their own segments again, if both slip or contradict."""
        other = self._imus.worn_by_name(worn.segment)
        if other is None or other.segment != worn.use.segment or other is worn:
            return
        if other.use.is_aligned and state.imus.contradicted_s[other.link] < 0.5 * CONTRADICTED_S:
            return
        for each in (worn, other):
            self._exclude(each, state)
            self._discard_known(each)
            self._imus.wear(each.use.segment, each.use.segment)
        self._places.restart_exchanges()

    def _discard_known(self, worn: WornImu) -> None:
        """Discard what is known of an IMU's alignment before it is aligned."""
        worn.former_alignment = None
        self._sensor_to_segment.pop(worn.use.segment, None)

    def _slip_as_known(self, stamp_ns: int, worn: WornImu, state: FilterState) -> None:
        """Exclude an IMU while it slips, where this is known in advance."""
        known = self._sensor_to_segment.get(worn.use.segment)
        if known is None or known.slip is None or stamp_ns < known.slip.begin_ns:
            return
        self._discard(worn, state)
        self._sensor_to_segment[worn.use.segment] = known.slip.after
        worn.slipping_until_ns = known.slip.end_ns

    def _exclude(self, worn: WornImu, state: FilterState) -> None:
        """Exclude an IMU until it is realigned."""
        self.changes += 1
        worn.use.is_aligned = False
        worn.alignment.clear()
        self._places.slips.forget(worn.segment)
        forget_imu(state, worn.link)

    def _alignment_of(self, worn: WornImu, state: FilterState) -> SensorToSegment:
        is_down = worn.use.segment in self.z_down
        return alignment_of(worn, state, z_down=is_down)
