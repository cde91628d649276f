"""Measurements of a captured person by two cameras and nine worn IMUs."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from pose_core.api import ImuSample, SkeletonSample, rigid_transform
from pose_core.arrays import FloatArray
from pose_sim.captured.clip import RATE, Clip
from pose_sim.captured.clips import chain, heading, read_clip, spun
from pose_sim.captured.imus import NINE, ImuModel, ImuStream, wear
from pose_sim.captured.trackers import SLOWEST_RATE, TRACKERS, TrackerFrames, TrackerModel, track
from pose_sim.scene import SENSORS

START_NS = 1_700_000_000_000_000_000
"""Stamp [ns] of a session's time zero."""
APART_DEG = (45.0, 95.0)  # [deg] angle between the cameras' directions from the person
HEIGHT_M = (1.0, 1.6)  # [m] height of a camera
MIN_DISTANCE, BEYOND_REACH = 3.0, 1.3  # [m] distance of a camera


@dataclass(frozen=True, kw_only=True)
class CapturedSpec:
    """Definition of a session."""

    name: str
    clips: tuple[Path, ...]
    trackers: tuple[str, str]  # of the two cameras
    spins: bool  # whether the person spins occasionally
    seed: int
    duration_s: float = 45.0
    condition: str = "known"  # prior knowledge of the cameras, for the evaluation
    delays_s: tuple[float, float] | None = None  # [s] of the trackers; None: each model's own
    uneven: bool = False  # whether every tracker skips frames for some time
    clock_offset_s: float = 0.0  # [s] by which the right camera's clock is ahead
    worn: tuple[str, ...] = NINE  # segments with an IMU
    imu: ImuModel = field(default_factory=ImuModel)  # of each of them

    @property
    def models(self) -> tuple[TrackerModel, TrackerModel]:
        """The trackers, with their delays."""
        left, right = (TRACKERS[name] for name in self.trackers)
        if self.uneven:
            left, right = (replace(each, slowest_rate=SLOWEST_RATE) for each in (left, right))
        if self.delays_s is None:
            return left, right
        return replace(left, delay=self.delays_s[0]), replace(right, delay=self.delays_s[1])

    @property
    def mean_delay_s(self) -> float:
        """Mean delay of the two trackers [s]."""
        return 0.5 * sum(model.delay for model in self.models)


@dataclass(frozen=True, kw_only=True)
class CapturedSession:
    """Measurements of two cameras and the IMUs, and the ground truth."""

    spec: CapturedSpec
    clip: Clip
    T_map_sensor: Mapping[str, FloatArray]  # (4, 4) of each camera
    frames: Mapping[str, TrackerFrames]
    imus: Sequence[ImuStream]

    def samples(self, *, imus: bool) -> list[SkeletonSample | ImuSample]:
        """All samples in the order of their arrival."""
        return [sample for _, sample in self.arrivals(imus=imus)]

    def arrivals(self, *, imus: bool) -> list[tuple[int, SkeletonSample | ImuSample]]:
        """The samples with their times of arrival [ns], which do not depend on clock offsets."""
        timed: list[tuple[int, SkeletonSample | ImuSample]] = []
        for sensor, frames in self.frames.items():
            ahead_s = self.spec.clock_offset_s if sensor == SENSORS[1] else 0.0
            for row, stamp_s in enumerate(frames.stamps_s.tolist()):
                sample = frames.sample(row, stamp_of(stamp_s + ahead_s), sensor, "1")
                timed.append((stamp_of(stamp_s), sample))
        for stream in self.imus if imus else ():
            for row, stamp_s in enumerate(stream.stamps_s.tolist()):
                imu_sample = ImuSample(
                    stamp_ns=stamp_of(stamp_s),
                    segment=stream.segment,
                    orientation=stream.orientation[row],
                    orientation_stddev=self.spec.imu.orientation_stddev,
                    angular_velocity=stream.angular_velocity[row],
                )
                timed.append((imu_sample.stamp_ns, imu_sample))
        return sorted(timed, key=lambda each: each[0])


def stamp_of(seconds: float) -> int:
    """Stamp [ns] of an instant of a session [s]."""
    return START_NS + round(seconds * 1e9)


def make_captured_session(spec: CapturedSpec) -> CapturedSession:
    """Simulate a session; the same spec gives the same result."""
    rng = np.random.default_rng(spec.seed)
    clip = chain([read_clip(path) for path in spec.clips], spec.duration_s)
    if spec.spins:
        clip = spun(clip, rng)
    places = place_cameras(clip, rng)
    frames = {
        sensor: track(clip.positions, places[sensor], model, rng)
        for sensor, model in zip(SENSORS, spec.models, strict=True)
    }
    return CapturedSession(
        spec=spec,
        clip=clip,
        T_map_sensor=places,
        frames=frames,
        imus=wear(clip, spec.imu, rng, spec.worn),
    )


def place_cameras(clip: Clip, rng: np.random.Generator) -> dict[str, FloatArray]:
    """Two cameras on a circle around the motion, looking at its middle; ``T_map_sensor``."""
    facing = float(heading(clip.positions[: round(RATE)]).mean()) + rng.uniform(-0.5, 0.5)
    apart = np.radians(rng.uniform(*APART_DEG))
    reach = np.linalg.norm(clip.positions[..., :2], axis=2).max()
    distance = max(MIN_DISTANCE, reach + BEYOND_REACH)
    places = {}
    for index, sensor in enumerate(SENSORS):
        angle = facing + (index - 0.5) * apart
        places[sensor] = camera_around(angle, distance, rng.uniform(*HEIGHT_M))
    return places


def camera_around(angle: float, distance: float, height: float) -> FloatArray:
    """Pose of a camera in a direction [rad] from map's origin, looking at a person there."""
    place = np.array([distance * np.cos(angle), distance * np.sin(angle), height])
    return looking_at(place, np.array([0.0, 0.0, 0.9]))


def looking_at(place: FloatArray, target: FloatArray) -> FloatArray:
    """Pose of a camera with z towards a target, x right and y down, (4, 4)."""
    z = (target - place) / np.linalg.norm(target - place)
    x = np.cross(z, [0.0, 0.0, 1.0])
    x /= np.linalg.norm(x)
    return rigid_transform(np.stack([x, np.cross(z, x), z], axis=1), place)
