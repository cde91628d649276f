r"""From an IMU's orientation to its segment's: its mounting, and which way its world turns.

While the person stands in the neutral pose, every segment's axes are the body's: upright, turned
by the heading that the cameras see. With the IMU's mean reading there, R_ws(0), the segment is

.. math:: R_{map,segment}(t) = Y\, R_{ws}(t)\, R_{ws}(0)^T\, Y^T\, R_z(\psi_{body}(0))

where Y turns the IMU's world, whose north is magnetic and disturbed, about the vertical into map.
The segment's long axis needs no Y: in the sensor it is R_ws(0)ᵀ e_z. So Y follows, whenever the
person moves, from the angle between where the IMU and where the cameras see that axis lean, in
closed form over all instants: the sums of cross and dot products of the horizontal parts.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from pose_fusion.imu.track import ImuState
from pose_fusion.kernels.imu import lean, read_segment
from pose_fusion.streams.samples import FloatArray

NEUTRAL_DURATION_NS = 1_500_000_000
NEUTRAL_ANGLE = np.radians(30.0)  # a joint further bent is not neutral
NEUTRAL_ELBOW = np.radians(60.0)  # hanging arms, half hidden by the trunk, seem more bent
LEAST_ANGLES_SEEN = 8  # [-] of the twelve, to call a pose neutral
STILL_RATE = 0.25  # [rad/s] an IMU that turns faster is not still
PRIOR_STRENGTH = 2.0  # [-] how much the IMUs' common heading counts beside an IMU's own samples
OBSERVED = 1.0  # [-] sum of squared horizontal lean after which the common heading is trusted


@dataclass(frozen=True, kw_only=True)
class SegmentReading:
    """What an aligned IMU says of its segment."""

    R_map_segment: FloatArray  # (3, 3)
    angular_velocity: FloatArray  # (3,) [rad/s] in map
    stddev: float  # [rad] of the sensor's tilt and heading together


class SegmentAlignment:
    """One IMU's mounting, from the neutral pose, and the sums that give its heading."""

    def __init__(self) -> None:
        self._neutral: list[FloatArray] = []
        self.R_world_sensor_neutral: FloatArray | None = None
        self.body_heading = 0.0  # [rad] in map, while the pose was neutral
        self.dot = 0.0
        self.cross = 0.0

    def collect_neutral(self, state: ImuState) -> None:
        """Remember a reading of the neutral pose."""
        self._neutral.append(state.R_world_sensor)

    def forget_neutral(self) -> None:
        """The person moved before the pose had been held for long enough."""
        self._neutral.clear()

    def finish_neutral(self, body_heading: float) -> None:
        """Take the mean of the collected readings as the mounting; heading sums start again."""
        if not self._neutral:
            return
        mean = Rotation.from_matrix(np.stack(self._neutral)).mean()
        self.R_world_sensor_neutral = np.asarray(mean.as_matrix())
        self.body_heading = body_heading
        self.dot = self.cross = 0.0
        self._neutral.clear()

    def observe_axis(self, state: ImuState, axis_map: FloatArray) -> None:
        """Compare where the IMU and the cameras see the segment's long axis.

        Args:
            state: The IMU's reading.
            axis_map: The segment's z axis in map as the cameras see it, shape (3,).
        """
        if self.R_world_sensor_neutral is None:
            return
        dot, cross = lean(state.R_world_sensor, self.R_world_sensor_neutral, axis_map)
        self.dot += dot
        self.cross += cross


class ImuAlignment:
    """The alignment of all IMUs on one body."""

    def __init__(self) -> None:
        self._segments: dict[str, SegmentAlignment] = {}
        self._common: tuple[float, float] | None = None  # sums of dot and cross over all IMUs
        self._still_since_ns: int | None = None
        self._still_angles: list[Mapping[str, float]] = []
        self._still_headings: list[float] = []

    def observe(
        self,
        stamp_ns: int,
        states: dict[str, ImuState],
        axes_map: dict[str, FloatArray],
        joint_angles: Mapping[str, float],
        body_heading: float,
    ) -> None:
        """Learn from one instant.

        Args:
            stamp_ns: The instant.
            states: Readings by segment.
            axes_map: The z axis of each segment that the cameras track well now, shape (3,).
            joint_angles: The measured angles [rad] by name, NaN unseen; they tell whether the pose
                is neutral.
            body_heading: Heading of the body in map [rad], as far as it stands neutrally.
        """
        self._common = None
        for segment in states:
            self._segments.setdefault(segment, SegmentAlignment())
        if self.awaits_neutral(states):
            self._watch_for_neutral(stamp_ns, states, joint_angles, body_heading)
        for segment, axis in axes_map.items():
            if segment in states:
                self._segments[segment].observe_axis(states[segment], axis)

    def awaits_neutral(self, segments: Iterable[str]) -> bool:
        """Whether the mounting of any of these is still to be found."""
        known = self._segments
        return any(s not in known or known[s].R_world_sensor_neutral is None for s in segments)

    def reading(self, segment: str, state: ImuState) -> SegmentReading | None:
        """The segment's rotation; None until mounting and heading are known."""
        alignment = self._segments.get(segment)
        if alignment is None or alignment.R_world_sensor_neutral is None:
            return None
        heading = self.heading(segment)
        if heading is None:
            return None
        R_map_segment, angular_velocity = np.empty((3, 3)), np.empty(3)
        read_segment(
            state.R_world_sensor,
            alignment.R_world_sensor_neutral,
            state.angular_velocity,
            heading,
            alignment.body_heading,
            R_map_segment,
            angular_velocity,
        )
        x, y, z = state.stddev.tolist()
        return SegmentReading(
            R_map_segment=R_map_segment,
            angular_velocity=angular_velocity,
            stddev=math.sqrt((x * x + y * y + z * z) / 3.0),
        )

    def heading(self, segment: str) -> float | None:
        """Turn [rad] about the vertical from the IMU's world to map; None if not yet observed."""
        own = self._segments[segment]
        if self._common is None:
            # In an order of their own: which IMU spoke first must not show, not even in rounding.
            ordered = [self._segments[name] for name in sorted(self._segments)]
            self._common = sum(s.dot for s in ordered), sum(s.cross for s in ordered)
        dot, cross = self._common
        strength = math.hypot(dot, cross)
        if strength < OBSERVED:
            return None
        scale = PRIOR_STRENGTH / strength
        return math.atan2(own.cross + scale * cross, own.dot + scale * dot)

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
            if self._segments[segment].R_world_sensor_neutral is None:
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
