"""Simultaneous measurements of IMUs and cameras, of an N-pose and the motion after it."""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pose_calibration.imus.n_pose import DURATION_NS, NPose, NPoseDetector, bend_limit
from pose_core.api import (
    BodyModel,
    Clocks,
    Extrinsics,
    FloatArray,
    ImuBlock,
    SkeletonSample,
    block_on_reference_clock,
    joint_angles,
    on_reference_clock,
    transformed,
)
from pose_core.body.trunk import heading_axes, standing_heading, trunk_axes
from pose_core.finite_numbers import nan_mean
from pose_core.imu.angular_velocity_check import AngularVelocityCheck
from pose_core.imu.imu_history import ImuHistory, ImuMeasurements
from pose_core.joints import JOINT_INDEX, JOINTS
from pose_core.stamps import NS_PER_S

PERIOD_NS = NS_PER_S // 10  # [ns] between stored instants
MOST_INSTANTS = 1200  # [-] stored of the motion: the latest two minutes
LATEST_NS = NS_PER_S // 20  # [ns] largest difference of stamps within an instant
STILL_RATE = 0.25  # [rad/s] largest angular velocity of an IMU at rest
SHORTEST_BONE = 0.01  # [m] joints nearer to each other than that give no direction
LINES = {"pelvis": ("right_hip", "left_hip"), "torso": ("right_shoulder", "left_shoulder")}


@dataclass(frozen=True, kw_only=True)
class Instant:
    """Measurements of all sensors at one instant."""

    stamp_ns: int
    views: FloatArray  # (sensors, 15, 3) [m] in map; NaN where not tracked
    imus: ImuMeasurements


@dataclass(frozen=True, kw_only=True)
class ImuObservations:
    """n instants of s IMUs as arrays; NaN where a measurement is missing."""

    segments: tuple[str, ...]
    times_s: FloatArray  # (n,) [s] since the middle of the N-pose
    R_world_sensor: FloatArray  # (n, s, 3, 3)
    rate: FloatArray  # (n, s) [rad/s]
    long_axis: FloatArray  # (n, s, 3) z of the segment in map, measured by the cameras
    line: FloatArray  # (n, s, 3) y of trunk and pelvis in map: shoulders' and hips' lines
    R_map_heading: FloatArray  # (n, 3, 3) the body's heading, measured by the cameras
    is_neutral: NDArray[np.bool_]  # (n,) during the N-pose
    neutral_heading: float  # [rad] of the body in map, in the N-pose


class ObservationRecorder:
    """Detects the N-pose and records measurements during it and the motion afterwards.

    Args:
        sensors: The Kinects' names.
        extrinsics: Poses and clocks of the Kinects.
        model: The body model, which gives the segments' links.
        camera_delay_s: Delay of joints behind their stamps [s].
    """

    def __init__(
        self,
        sensors: Sequence[str],
        extrinsics: Extrinsics,
        model: BodyModel,
        camera_delay_s: float,
    ) -> None:
        self._sensors = tuple(sensors)
        self._model = model
        self._delay_ns = round(camera_delay_s * NS_PER_S)
        self.clocks: Clocks = extrinsics.clocks
        self._placed = {name: extrinsics.T_map_sensor(name) for name in sensors}
        self._rates = AngularVelocityCheck()
        self._tracks = ImuHistory()
        self._views = np.full((len(sensors), len(JOINTS), 3), np.nan)
        self._views_ns = np.zeros(len(sensors), np.int64)
        self._watcher = NPoseDetector()
        self._standing: deque[Instant] = deque()
        self._moving: deque[Instant] = deque(maxlen=MOST_INSTANTS)
        self._kept_ns = 0
        self.stand: NPose | None = None

    @property
    def segments(self) -> tuple[str, ...]:
        """Segments of the body model whose IMU has samples."""
        return tuple(sorted(s for s in self._tracks.segments if s in self._model.segments))

    @property
    def moved_s(self) -> float:
        """Duration [s] recorded since the N-pose."""
        return len(self._moving) * PERIOD_NS / NS_PER_S

    @property
    def joints(self) -> FloatArray:
        """Current mean of the sensors' tracked joints in map [m], shape (15, 3); NaN if unknown."""
        return nan_mean(self._views)

    def add_imu(self, block: ImuBlock) -> None:
        """Add samples of IMUs."""
        block = self._rates.checked(block_on_reference_clock(block, self.clocks))
        self._tracks.add(block)

    def add_skeleton(self, sample: SkeletonSample) -> None:
        """Add one sensor's skeleton of the person."""
        if sample.sensor not in self._placed:
            return
        sample = on_reference_clock(sample, self.clocks)
        positions = transformed(self._placed[sample.sensor], sample.positions)
        index = self._sensors.index(sample.sensor)
        self._views[index] = transformed(self._placed[sample.sensor], sample.tracked)
        self._views_ns[index] = sample.stamp_ns
        self._views[np.abs(self._views_ns - sample.stamp_ns) > LATEST_NS] = np.nan
        self._keep(sample.stamp_ns)
        if self.stand is None:
            self._watch(sample, positions, index)

    def _keep(self, stamp_ns: int) -> None:
        if abs(stamp_ns - self._kept_ns) < PERIOD_NS:
            return
        self._kept_ns = stamp_ns
        imus = self._tracks.at(stamp_ns - self._delay_ns)
        instant = Instant(stamp_ns=stamp_ns, views=self._views.copy(), imus=imus)
        if self.stand is not None:
            self._moving.append(instant)
            return
        self._standing.append(instant)
        while abs(stamp_ns - self._standing[0].stamp_ns) > DURATION_NS:
            self._standing.popleft()

    def _watch(self, sample: SkeletonSample, positions: FloatArray, index: int) -> None:
        """Detect the N-pose, during which the IMUs must be at rest too."""
        views = np.full_like(self._views, np.nan)
        state = np.zeros(views.shape[:2], np.uint8)
        views[index], state[index] = positions, sample.tracking_state
        stand = self._watcher.add(sample.stamp_ns, views, state)
        if stand is None or not self.segments:
            return
        if self.is_still:
            self.stand = stand
        else:
            self._watcher = NPoseDetector()

    @property
    def is_still(self) -> bool:
        """Whether all IMUs have recent samples and rotate slowly."""
        rates = [
            rate
            for instant in self._standing
            for rate in np.linalg.norm(instant.imus.angular_velocity, axis=1)
        ]
        return bool(rates) and float(np.percentile(rates, 90.0)) < STILL_RATE

    def posture(self) -> str:
        """Reason why the pose is not an N-pose; empty if it is one."""
        joints = self.joints
        unseen = [name for name, row in JOINT_INDEX.items() if np.isnan(joints[row, 0])]
        if unseen:
            return f"the cameras do not see the {unseen[0].replace('_', ' ')}"
        angles = {name: abs(float(a[0])) for name, a in joint_angles(joints[None]).items()}
        worst = max(angles, key=lambda name: angles[name] / bend_limit(name))
        if angles[worst] > bend_limit(worst):
            return f"{worst.replace('_', ' ')} is {np.degrees(angles[worst]):.0f} deg"
        return ""

    def observations(self) -> ImuObservations | None:
        """All measurements since the N-pose; None before it."""
        if self.stand is None:
            return None
        instants = [*self._standing, *self._moving]
        count, segments = len(instants), self.segments
        R_world_sensor = np.full((count, len(segments), 3, 3), np.nan)
        rate = np.full((count, len(segments)), np.nan)
        R_map_heading = np.full((count, 3, 3), np.nan)
        joints = np.full((count, len(JOINTS), 3), np.nan)
        for k, instant in enumerate(instants):
            for row, segment in enumerate(instant.imus.segments):
                if segment in segments:
                    i = segments.index(segment)
                    R_world_sensor[k, i] = instant.imus.R_world_sensor[row]
                    rate[k, i] = np.linalg.norm(instant.imus.angular_velocity[row])
            R_map_heading[k] = heading_axes(nan_mean(instant.views))
            # Each tracker's bias of the joints is estimated in the N-pose.
            joints[k] = nan_mean(instant.views - self.stand.offsets @ R_map_heading[k].T)
        long_axis, line = _axes(self._model, segments, joints)
        stamps = np.array([instant.stamp_ns for instant in instants], np.int64)
        middle_ns = self.stand.stamp_ns - DURATION_NS // 2
        is_neutral = np.arange(count) < len(self._standing)
        headings = [standing_heading(nan_mean(instant.views)) for instant in self._standing]
        return ImuObservations(
            segments=segments,
            times_s=np.asarray((stamps - middle_ns) * 1e-9, np.float64),
            R_world_sensor=R_world_sensor,
            rate=rate,
            long_axis=long_axis,
            line=line,
            R_map_heading=R_map_heading,
            is_neutral=is_neutral,
            neutral_heading=float(np.angle(np.nanmean(np.exp(1j * np.array(headings))))),
        )


def _axes(
    model: BodyModel, segments: Sequence[str], joints: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Long axes and lines, (n, s, 3), of joints [m], (n, 15, 3); NaN without the trunk's axes."""
    long, line = np.full((2, len(joints), len(segments), 3), np.nan)
    trunk = trunk_axes(joints)
    joints = np.where(np.isfinite(trunk[:, :1, :1]), joints, np.nan)
    for i, segment in enumerate(segments):
        start, end = model.ends(model.segments[segment])
        direction = model.joints[end].direction
        between = _between(joints, start, end)
        long[:, i] = trunk[..., 2] if direction is None else direction[2] * between
        if segment in LINES:
            line[:, i] = _between(joints, *LINES[segment])
    return long, line


def _between(joints: FloatArray, start: str, end: str) -> FloatArray:
    """Unit vectors from one joint to another, (n, 3)."""
    bones = joints[:, JOINT_INDEX[end]] - joints[:, JOINT_INDEX[start]]
    length = np.linalg.norm(bones, axis=1, keepdims=True)
    return bones / np.where(length > SHORTEST_BONE, length, np.nan)
