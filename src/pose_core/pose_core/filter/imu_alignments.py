"""All IMUs of one body: which are aligned, which are not and why, and what gathers meanwhile."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from pose_core.body.model import BodyModel
from pose_core.filter.imu import NO_IMUS, ImuReadings
from pose_core.filter.imu_use import ImuUse
from pose_core.filter.sensor_alignment import AlignmentTuning, SegmentAlignment
from pose_core.filter.state import IMU_STATES, NO_COLUMN, FilterState, with_imu
from pose_core.imu.mounting import Mounting
from pose_core.imu.track import ImuStates
from pose_core.stamps import NS_PER_S

SOLVE_PERIOD_NS = NS_PER_S // 2
CONTRADICTED_S = 0.5  # [s] after which an IMU that the cameras contradict is aligned anew
LONGEST_STEP_S = 0.1  # [s] that one instant stands for


@dataclass(kw_only=True)
class _Worn:
    link: int
    use: ImuUse
    alignment: SegmentAlignment
    mounting: Mounting | None = field(default=None)


class ImuAlignments:
    """Aligns each IMU with its link and hands the aligned ones' readings to the filter.

    Args:
        model: The body model: which link a segment is.
        tuning: Of the alignment.
    """

    def __init__(self, model: BodyModel, tuning: AlignmentTuning | None = None) -> None:
        self._model = model
        self._tuning = tuning or AlignmentTuning()
        self._worn: dict[str, _Worn] = {}
        self._mountings: Mapping[str, Mounting] = {}
        self._observed_ns: int | None = None
        self._solved_ns: int | None = None

    @property
    def uses(self) -> tuple[ImuUse, ...]:
        """What becomes of each IMU that was heard, by segment's name."""
        return tuple(self._worn[name].use for name in sorted(self._worn))

    def use_mountings(self, mountings: Mapping[str, Mounting]) -> None:
        """Take how IMUs sit from a calibration; headings are still found from motion."""
        self._mountings = mountings

    def restart(self) -> None:
        """A new filter knows no alignment; what was gathered stays."""
        self._observed_ns = None
        for worn in self._worn.values():
            worn.use.is_aligned = False

    def aligned_links(self, states: ImuStates) -> list[int]:
        """The links of the aligned IMUs among those that say something."""
        worn = [self._worn_on(segment) for segment in states.segments]
        return [each.link for each in worn if each is not None and each.use.is_aligned]

    def readings(self, states: ImuStates) -> ImuReadings:
        """Those of the aligned IMUs, as the filter takes them."""
        rows, links = [], []
        for row, segment in enumerate(states.segments):
            worn = self._worn_on(segment)
            if worn is None:
                continue
            worn.use.readings += 1
            if worn.use.is_aligned:
                worn.use.used += 1
                rows.append(row)
                links.append(worn.link)
        if not rows:
            return NO_IMUS
        return ImuReadings(
            np.array(links, np.int64),
            np.ascontiguousarray(states.R_world_sensor[rows]),
            np.ascontiguousarray(states.angular_velocity[rows]),
            np.ascontiguousarray(states.age_s[rows]),
        )

    def observe(self, stamp_ns: int, states: ImuStates, state: FilterState) -> FilterState:
        """Learn from one instant; the state with the IMUs that were aligned by it.

        Args:
            stamp_ns: The instant [ns].
            states: All IMUs' readings.
            state: The filter's, after the cameras' frame.
        """
        before_ns, self._observed_ns = self._observed_ns, stamp_ns
        if before_ns is None or stamp_ns < before_ns:
            self._solved_ns = stamp_ns
            return state
        dt_s = min((stamp_ns - before_ns) / NS_PER_S, LONGEST_STEP_S)
        for row, segment in enumerate(states.segments):
            worn = self._worn_on(segment)
            if worn is None:
                continue
            if worn.use.is_aligned:
                self._check(worn, state)
                continue
            own = slice(3 + 3 * worn.link, 6 + 3 * worn.link)
            worn.alignment.observe(
                dt_s,
                states.R_world_sensor[row],
                state.pose.rotations[worn.link],
                state.P[own, own],
                state.pose.rates[worn.link],
            )
        if stamp_ns - (self._solved_ns or 0) >= SOLVE_PERIOD_NS:
            self._solved_ns = stamp_ns
            state = self._solve(stamp_ns, states.segments, state)
        return state

    def _solve(self, stamp_ns: int, heard: Sequence[str], state: FilterState) -> FilterState:
        """Align those that have been seen to move enough; tell how well the others are known."""
        for segment in heard:
            worn = self._worn_on(segment)
            if worn is None:
                continue
            if not worn.use.is_aligned:
                found = worn.alignment.solve(self._mountings.get(segment))
                if found is None:
                    continue
                worn.use.is_aligned, worn.use.aligned_ns = True, stamp_ns
                covariance = self._tuning.covariance_factor * found.covariance
                state = with_imu(
                    state,
                    worn.link,
                    found.R_sensor_link,
                    found.heading,
                    covariance,
                )
            self._note(worn, state)
        return state

    def _check(self, worn: _Worn, state: FilterState) -> None:
        """Align an IMU anew that the cameras contradict; its parent's first, if that has one."""
        if state.contradicted_s[worn.link] < CONTRADICTED_S:
            return
        if self._is_parent_contradicted(worn, state):
            return
        worn.use.is_aligned = False
        worn.use.contradictions += 1
        worn.alignment.clear()
        state.contradicted_s[worn.link] = 0.0
        column = int(state.imu_column[worn.link])
        own = slice(column, column + IMU_STATES)
        state.P[own, :] = 0.0
        state.P[:, own] = 0.0

    def _is_parent_contradicted(self, worn: _Worn, state: FilterState) -> bool:
        """Whether the parent link has an aligned IMU that is under suspicion itself."""
        parent = self._model.links[self._model.link_names[worn.link]].parent
        if parent is None:
            return False
        above = self._model.link_names.index(parent)
        has_imu = any(e.link == above and e.use.is_aligned for e in self._worn.values())
        return has_imu and bool(state.contradicted_s[above] > 0.5 * CONTRADICTED_S)

    def _note(self, worn: _Worn, state: FilterState) -> None:
        column = int(state.imu_column[worn.link])
        variance = np.diag(state.P)[column : column + IMU_STATES]
        worn.use.tilt_stddev = float(np.sqrt(max(variance[0], variance[1], 0.0)))
        worn.use.turn_stddev = float(np.sqrt(max(variance[2], 0.0)))
        worn.use.heading_stddev = float(np.sqrt(max(variance[3], 0.0)))

    def _worn_on(self, segment: str) -> _Worn | None:
        """What is known of a segment's IMU; None if the model has no link for it."""
        worn = self._worn.get(segment)
        if worn is None:
            link_name = self._model.segments.get(segment)
            is_known = link_name is not None
            link = self._model.link_names.index(link_name) if link_name is not None else NO_COLUMN
            worn = _Worn(
                link=link,
                use=ImuUse(segment=segment, is_known=is_known),
                alignment=SegmentAlignment(self._tuning),
            )
            self._worn[segment] = worn
        return worn if worn.use.is_known else None
