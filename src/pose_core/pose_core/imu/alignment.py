r"""From an IMU's orientation to its segment's: its mounting, and which way its world turns.

While the person stands in the neutral pose, every segment's axes are the body's: upright, turned
by the heading that the cameras see. With the IMU's mean reading there, R_ws(0), the segment is

.. math::
    R_{map,segment}(t) = Y(t)\, R_{ws}(t)\, R_{ws}(0)^T\, Y(0)^T\, R_z(\psi_{body}(0))

where Y turns the IMU's world, whose north is magnetic and disturbed, or drifts, about the vertical
into map. The segment's long axis needs no Y: in the sensor it is R_ws(0)ᵀ e_z. So Y follows,
whenever the person moves, from the angle between where the IMU and where the cameras see that axis
lean: :mod:`pose_core.imu.heading`. Until an IMU's own segment has leant, IMUs that all know north
lend it their common heading.

Where a calibration has found the mounting :math:`M = R_{sensor,segment}` already, the segment is
:math:`Y R_{ws} M`, and no neutral pose is waited for.
"""

import math
from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from pose_core.imu.joints import JointTurn
from pose_core.imu.mounting import Mountings
from pose_core.imu.readings import SegmentReadings
from pose_core.imu.segment_alignment import AlignmentRows, SegmentAlignment
from pose_core.imu.track import ImuStates
from pose_core.kernels.alignment import Sights, advance, observe, read_all
from pose_core.kernels.compiling import settled
from pose_core.kernels.heading import relate

NEUTRAL_DURATION_NS = 1_500_000_000
NEUTRAL_ANGLE = np.radians(30.0)  # a joint further bent is not neutral
NEUTRAL_ELBOW = np.radians(60.0)  # hanging arms, half hidden by the trunk, seem more bent
LEAST_ANGLES_SEEN = 8  # [-] of the twelve, to call a pose neutral
JUMP_BACK_NS = 1_000_000_000  # further back than this, a recording has begun anew
STILL_RATE = 0.25  # [rad/s] an IMU that turns faster is not still
COMMON_STDDEV = math.radians(15.0)  # [rad] of the common heading, for one IMU
OBSERVED_S = 0.1  # [s] of an axis fully horizontal after which the common heading is lent
NORTH_STDDEV = math.radians(45.0)  # [rad] of its own heading beyond which an IMU knows no north


class ImuAlignment:
    """The alignment of all IMUs on one body."""

    def __init__(self) -> None:
        self._advance, self._observe = settled(advance), settled(observe)
        self._read_all, self._relate = settled(read_all), settled(relate)
        self._rows = AlignmentRows()
        self._segments: dict[str, SegmentAlignment] = {}
        self._asked: dict[tuple[str, ...], NDArray[np.int64]] = {}
        self._have_stood: set[tuple[str, ...]] = set()
        self._stamp_ns: int | None = None
        self._observed_ns: int | None = None  # of the last observation: cameras may be behind
        self._still_since_ns: int | None = None
        self._still_angles: list[Mapping[str, float]] = []
        self._still_headings: list[float] = []

    def use_mountings(self, mountings: Mountings) -> None:
        """Take these segments' mountings from a calibration; the others' are still sought."""
        for segment, mounting in mountings.items():
            self._segment(segment).use_mounting(mounting)

    def _segment(self, name: str) -> SegmentAlignment:
        if name not in self._segments:
            self._segments[name] = SegmentAlignment(self._rows)
        return self._segments[name]

    def _rows_of(self, segments: tuple[str, ...]) -> NDArray[np.int64]:
        """The IMUs' rows; those that were not known are begun."""
        rows = self._asked.get(segments)
        if rows is None:
            rows = np.array([self._segment(name).row for name in segments], np.int64)
            self._asked[segments] = rows
        return rows

    def observe(
        self,
        stamp_ns: int,
        states: ImuStates,
        sights: Sights,
        joint_angles: Mapping[str, float],
        body_heading: float,
    ) -> None:
        """Learn from one instant.

        Args:
            stamp_ns: The instant.
            states: The IMUs' readings.
            sights: The axes of their segments that the cameras track well now, in their order; the
                lateral ones where trunk or hinge shows them.
            joint_angles: The measured angles [rad] by name, NaN unseen; they tell whether the pose
                is neutral.
            body_heading: Heading of the body in map [rad], as far as it stands neutrally.
        """
        self.advance(stamp_ns)
        dt_s = self._since_observation(stamp_ns)
        rows = self._rows_of(states.segments)
        if self.awaits_neutral(states.segments):
            self._watch_for_neutral(stamp_ns, states, joint_angles, body_heading)
        is_any_unknown = self._observe(
            self._rows.anchors, self._rows.mounted, rows, dt_s, states.R_world_sensor, sights
        )
        if is_any_unknown:
            self._lend_common_heading(states)

    def advance(self, stamp_ns: int) -> None:
        """Let the headings drift on to an instant."""
        dt_s = _elapsed_s(self._stamp_ns, stamp_ns)
        if dt_s is None:
            return
        self._stamp_ns = stamp_ns
        self._advance(self._rows.anchors, dt_s)

    def relate(self, turns: Iterable[JointTurn]) -> int:
        """Learn from what joints show of the headings' differences.

        How many contradicted what is known; where a heading is not known yet nothing is learnt.
        """
        rejected = 0
        for each in turns:
            child, parent = self._segments.get(each.child), self._segments.get(each.parent)
            if child is None or parent is None:
                continue
            rejected += not self._relate(
                self._rows.anchors, child.row, parent.row, each.turn, each.variance, each.noise
            )
        return rejected

    def _since_observation(self, stamp_ns: int) -> float:
        """Time since the cameras' instant before [s].

        Where they lag behind the IMUs, the headings have drifted on beyond it already.
        """
        dt_s = _elapsed_s(self._observed_ns, stamp_ns)
        if dt_s is None:
            return 0.0
        self._observed_ns = stamp_ns
        return dt_s

    def lose_heading(self, segment: str) -> None:
        """An IMU that knows no north has begun anew: its world may have turned to anywhere."""
        if segment in self._segments:
            self._segments[segment].anchor.lose_heading()

    def awaits_neutral(self, segments: tuple[str, ...]) -> bool:
        """Whether any of these has not been heard in a neutral stand yet."""
        if segments in self._have_stood:
            return False
        known = self._segments
        if any(s not in known or not known[s].has_stood for s in segments):
            return True
        self._have_stood.add(segments)
        return False

    def readings(self, states: ImuStates) -> SegmentReadings:
        """The segments' rotations, of those whose mounting and heading are known."""
        rows = self._rows_of(states.segments)
        count = len(rows)
        R_map_segment, rate, stddev = (
            np.empty((count, 3, 3)),
            np.empty((count, 3)),
            np.empty((count, 3)),
        )
        aligned = self._read_all(
            self._rows.anchors,
            self._rows.mounted,
            rows,
            states.R_world_sensor,
            states.angular_velocity,
            states.stddev,
            R_map_segment,
            rate,
            stddev,
        )
        known = len(aligned)
        segments = states.segments
        return SegmentReadings(
            segments=segments if known == count else tuple(segments[m] for m in aligned.tolist()),
            R_map_segment=R_map_segment[:known],
            angular_velocity=rate[:known],
            stddev=stddev[:known],
            age_s=states.age_s if known == count else states.age_s[aligned],
        )

    def heading(self, segment: str) -> float | None:
        """Turn [rad] about the vertical from the IMU's world to map; None if not yet observed."""
        return self._segments[segment].anchor.heading

    def _lend_common_heading(self, states: ImuStates) -> None:
        """Start those IMUs that know north, but have not yet leant, with the others' heading."""
        waiting = [
            (s, a)
            for s, a in self._segments.items()
            if s in states and a.is_mounted and a.anchor.heading is None
        ]
        north = [s for s in sorted(states) if states[s].stddev[2] < NORTH_STDDEV]
        recent = [self._segments[s].anchor.recent for s in north]
        dot, cross = sum(d for d, _ in recent), sum(c for _, c in recent)
        if math.hypot(dot, cross) < OBSERVED_S:
            return
        for segment, alignment in waiting:
            if segment in north:
                alignment.anchor.start(math.atan2(cross, dot), COMMON_STDDEV)

    @property
    def mountings(self) -> Mountings:
        """The mountings that a calibration has told."""
        told = {name: a.mounting for name, a in sorted(self._segments.items())}
        return {name: mounting for name, mounting in told.items() if mounting is not None}

    @property
    def heading_restarts(self) -> dict[str, int]:
        """How often an IMU's world was found to have turned at once, by segment, where it has."""
        restarts = {name: a.anchor.restarts for name, a in sorted(self._segments.items())}
        return {name: count for name, count in restarts.items() if count}

    @property
    def known_segments(self) -> list[str]:
        """Segments whose IMU is aligned."""
        return [
            s
            for s, a in sorted(self._segments.items())
            if a.is_mounted and self.heading(s) is not None
        ]

    def _watch_for_neutral(
        self,
        stamp_ns: int,
        states: ImuStates,
        joint_angles: Mapping[str, float],
        body_heading: float,
    ) -> None:
        """Take the mounting where the person has stood still, and neutral, for long enough."""
        rates = np.linalg.norm(states.angular_velocity, axis=1)
        is_still = bool((rates < STILL_RATE).all())
        since_ns = self._still_since_ns
        if not is_still or since_ns is None or not stamp_ns - since_ns >= 0:
            self._begin_stillness(stamp_ns if is_still else None)
        if not is_still:
            return
        self._still_angles.append(joint_angles)
        self._still_headings.append(body_heading)
        for segment, state in states.items():
            if not self._segments[segment].has_stood:
                self._segments[segment].collect_neutral(state)
        if self._still_since_ns is None or stamp_ns - self._still_since_ns < NEUTRAL_DURATION_NS:
            return
        if _is_neutral(self._still_angles):
            turns = np.array(self._still_headings)
            body_heading = float(np.arctan2(np.mean(np.sin(turns)), np.mean(np.cos(turns))))
            for alignment in self._segments.values():
                alignment.finish_neutral(body_heading)
        self._begin_stillness(None)

    def _begin_stillness(self, stamp_ns: int | None) -> None:
        self._still_since_ns = stamp_ns
        self._still_angles.clear()
        self._still_headings.clear()
        for alignment in self._segments.values():
            alignment.forget_neutral()


def _elapsed_s(before_ns: int | None, stamp_ns: int) -> float | None:
    """Time from an instant to another [s], 0 where a recording begins anew; None: they cross."""
    if before_ns is None:
        return 0.0
    if before_ns - JUMP_BACK_NS < stamp_ns < before_ns:
        return None
    return max(stamp_ns - before_ns, 0) * 1e-9


def _is_neutral(angles: Sequence[Mapping[str, float]]) -> bool:
    """Whether the median of every joint angle that was seen is small."""
    seen = 0
    for name in angles[0]:
        values = np.array([each[name] for each in angles])
        values = values[np.isfinite(values)]
        if len(values) == 0:
            continue
        seen += 1
        limit = NEUTRAL_ELBOW if "elbow" in name else NEUTRAL_ANGLE
        if abs(float(np.median(values))) > limit:
            return False
    return seen >= LEAST_ANGLES_SEEN
