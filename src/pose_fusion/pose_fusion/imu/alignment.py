r"""From an IMU's orientation to its segment's: its mounting, and which way its world turns.

While the person stands in the neutral pose, every segment's axes are the body's: upright, turned
by the heading that the cameras see. With the IMU's mean reading there, R_ws(0), the segment is

.. math::
    R_{map,segment}(t) = Y(t)\, R_{ws}(t)\, R_{ws}(0)^T\, Y(0)^T\, R_z(\psi_{body}(0))

where Y turns the IMU's world, whose north is magnetic and disturbed, or drifts, about the vertical
into map. The segment's long axis needs no Y: in the sensor it is R_ws(0)ᵀ e_z. So Y follows,
whenever the person moves, from the angle between where the IMU and where the cameras see that axis
lean: :mod:`pose_fusion.imu.heading`. Until an IMU's own segment has leant, IMUs that all know north
lend it their common heading.

Where a calibration has found the mounting :math:`M = R_{sensor,segment}` already, the segment is
:math:`Y R_{ws} M`, and no neutral pose is waited for.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from pose_fusion.imu.heading import HeadingAnchor
from pose_fusion.imu.mounting import Mounting, Mountings
from pose_fusion.imu.seen_axes import Seen
from pose_fusion.imu.track import ImuState
from pose_fusion.kernels.imu import read_segment
from pose_fusion.streams.samples import FloatArray

NEUTRAL_DURATION_NS = 1_500_000_000
NEUTRAL_ANGLE = np.radians(30.0)  # a joint further bent is not neutral
NEUTRAL_ELBOW = np.radians(60.0)  # hanging arms, half hidden by the trunk, seem more bent
LEAST_ANGLES_SEEN = 8  # [-] of the twelve, to call a pose neutral
JUMP_BACK_NS = 1_000_000_000  # further back than this, a recording has begun anew
STILL_RATE = 0.25  # [rad/s] an IMU that turns faster is not still
STANDING_STDDEV = math.radians(4.0)  # [rad] by which people stand beside a segment's heading
COMMON_STDDEV = math.radians(15.0)  # [rad] of the common heading, for one IMU
OBSERVED_S = 0.1  # [s] of an axis fully horizontal after which the common heading is lent
NORTH_STDDEV = math.radians(45.0)  # [rad] of its own heading beyond which an IMU knows no north
UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, kw_only=True)
class SegmentReading:
    """What an aligned IMU says of its segment."""

    R_map_segment: FloatArray  # (3, 3)
    angular_velocity: FloatArray  # (3,) [rad/s] in map
    stddev: float  # [rad] of the sensor's tilt and heading together
    age_s: float = 0.0  # [s] for which the gyroscope has carried it on


class SegmentAlignment:
    """One IMU's mounting, from the neutral pose, and its heading."""

    def __init__(self) -> None:
        self._neutral: list[FloatArray] = []
        self.R_world_sensor_neutral: FloatArray | None = None
        self.body_heading = 0.0  # [rad] in map, while the pose was neutral
        self.anchor = HeadingAnchor()
        self.mounting: Mounting | None = None  # where a calibration has found it
        self.has_stood = False

    def use_mounting(self, mounting: Mounting) -> None:
        """Take the mounting as it is, from a calibration; only the heading is sought."""
        self.mounting = mounting
        self.R_world_sensor_neutral = mounting.R_sensor_segment.T
        self.body_heading = 0.0
        self.anchor = HeadingAnchor(is_mounting_known=True)

    def collect_neutral(self, state: ImuState) -> None:
        """Remember a reading of the neutral pose."""
        self._neutral.append(state.R_world_sensor)

    def forget_neutral(self) -> None:
        """The person moved before the pose had been held for long enough."""
        self._neutral.clear()

    def finish_neutral(self, body_heading: float) -> None:
        """Take the mean of the collected readings as the mounting; the heading is sought anew."""
        if not self._neutral:
            return
        mean = Rotation.from_matrix(np.stack(self._neutral)).mean()
        self.has_stood = True
        if self.mounting is not None:
            x, y, _ = (mean.as_matrix() @ self.mounting.R_sensor_segment)[:, 0]
            turn = math.remainder(body_heading - math.atan2(y, x), 2.0 * math.pi)
            self.anchor.observe_standing(turn, STANDING_STDDEV)
            self._neutral.clear()
            return
        self.R_world_sensor_neutral = np.asarray(mean.as_matrix())
        self.body_heading = body_heading
        self.anchor = HeadingAnchor()
        self._neutral.clear()

    def observe_axis(self, dt_s: float, state: ImuState, axis_map: FloatArray) -> None:
        """Compare where the IMU and the cameras see the segment's long axis.

        Args:
            dt_s: Time [s] that this instant stands for.
            state: The IMU's reading.
            axis_map: The segment's z axis in map as the cameras see it, shape (3,).
        """
        if self.R_world_sensor_neutral is None:
            return
        axis_world = state.R_world_sensor @ (self.R_world_sensor_neutral.T @ UP)
        self.anchor.observe_lean(dt_s, axis_world, axis_map)

    def observe_lateral(self, dt_s: float, state: ImuState, seen: Seen) -> None:
        """Compare where the IMU and the cameras see the segment's lateral axis, y.

        Args:
            dt_s: Time [s] that this instant stands for.
            state: The IMU's reading.
            seen: The segment's y axis.
        """
        neutral = self.anchor.neutral_heading
        if self.R_world_sensor_neutral is None or neutral is None:
            return
        turn = self.body_heading - neutral
        lateral = np.array([-math.sin(turn), math.cos(turn), 0.0])
        axis_world = state.R_world_sensor @ (self.R_world_sensor_neutral.T @ lateral)
        self.anchor.observe_turned(dt_s, axis_world, *seen)


class ImuAlignment:
    """The alignment of all IMUs on one body."""

    def __init__(self) -> None:
        self._segments: dict[str, SegmentAlignment] = {}
        self._stamp_ns: int | None = None
        self._observed_ns: int | None = None  # of the last observation: cameras may be behind
        self._still_since_ns: int | None = None
        self._still_angles: list[Mapping[str, float]] = []
        self._still_headings: list[float] = []

    def use_mountings(self, mountings: Mountings) -> None:
        """Take these segments' mountings from a calibration; the others' are still sought."""
        for segment, mounting in mountings.items():
            self._segments.setdefault(segment, SegmentAlignment()).use_mounting(mounting)

    def observe(
        self,
        stamp_ns: int,
        states: dict[str, ImuState],
        axes_map: dict[str, FloatArray],
        joint_angles: Mapping[str, float],
        body_heading: float,
        laterals_map: Mapping[str, Seen] | None = None,
    ) -> None:
        """Learn from one instant.

        Args:
            stamp_ns: The instant.
            states: Readings by segment.
            axes_map: The z axis of each segment that the cameras track well now, shape (3,).
            joint_angles: The measured angles [rad] by name, NaN unseen; they tell whether the pose
                is neutral.
            body_heading: Heading of the body in map [rad], as far as it stands neutrally.
            laterals_map: The y axis of each segment where trunk or hinge shows it now.
        """
        self.advance(stamp_ns)
        dt_s = self._since_observation(stamp_ns)
        for segment in states:
            self._segments.setdefault(segment, SegmentAlignment())
        if self.awaits_neutral(states):
            self._watch_for_neutral(stamp_ns, states, joint_angles, body_heading)
        for segment, axis in axes_map.items():
            if segment in states:
                self._segments[segment].observe_axis(dt_s, states[segment], axis)
        for segment, seen in (laterals_map or {}).items():
            if segment in states:
                self._segments[segment].observe_lateral(dt_s, states[segment], seen)
        self._lend_common_heading(states)

    def advance(self, stamp_ns: int) -> None:
        """Let the headings drift on to an instant."""
        dt_s = _elapsed_s(self._stamp_ns, stamp_ns)
        if dt_s is None:
            return
        self._stamp_ns = stamp_ns
        for alignment in self._segments.values():
            alignment.anchor.predict(dt_s)

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

    def awaits_neutral(self, segments: Iterable[str]) -> bool:
        """Whether any of these has not been heard in a neutral stand yet."""
        known = self._segments
        return any(s not in known or not known[s].has_stood for s in segments)

    def reading(self, segment: str, state: ImuState) -> SegmentReading | None:
        """The segment's rotation; None until mounting and heading are known."""
        alignment = self._segments.get(segment)
        if alignment is None or alignment.R_world_sensor_neutral is None:
            return None
        heading, neutral_heading = alignment.anchor.heading, alignment.anchor.neutral_heading
        if heading is None or neutral_heading is None:
            return None
        R_map_segment, angular_velocity = np.empty((3, 3)), np.empty(3)
        read_segment(
            state.R_world_sensor,
            alignment.R_world_sensor_neutral,
            state.angular_velocity,
            heading,
            alignment.body_heading - neutral_heading,
            R_map_segment,
            angular_velocity,
        )
        x, y, _ = state.stddev.tolist()
        z = alignment.anchor.stddev
        return SegmentReading(
            R_map_segment=R_map_segment,
            angular_velocity=angular_velocity,
            stddev=math.sqrt((x * x + y * y + z * z) / 3.0),
            age_s=state.age_s,
        )

    def heading(self, segment: str) -> float | None:
        """Turn [rad] about the vertical from the IMU's world to map; None if not yet observed."""
        return self._segments[segment].anchor.heading

    def _lend_common_heading(self, states: Mapping[str, ImuState]) -> None:
        """Start those IMUs that know north, but have not yet leant, with the others' heading."""
        waiting = [
            (s, a)
            for s, a in self._segments.items()
            if s in states and a.R_world_sensor_neutral is not None and a.anchor.heading is None
        ]
        if not waiting:
            return
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
            if a.R_world_sensor_neutral is not None and self.heading(s) is not None
        ]

    def _watch_for_neutral(
        self,
        stamp_ns: int,
        states: dict[str, ImuState],
        joint_angles: Mapping[str, float],
        body_heading: float,
    ) -> None:
        """Take the mounting where the person has stood still, and neutral, for long enough."""
        is_still = all(np.linalg.norm(s.angular_velocity) < STILL_RATE for s in states.values())
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
