"""Several captured persons before two cameras, who cross, occlude each other, leave and return.

Each performs captured motion along a separate path through the room. A camera loses an occluded
person; a person who reappears has the former id, a new one, or that of the occluding person, which
simulates the identity switches of trackers.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import permutations
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation

from pose_core.api import SkeletonSample
from pose_core.arrays import FloatArray
from pose_io.arrays import BoolArray
from pose_sim.captured.clip import RATE, Clip
from pose_sim.captured.clips import chain, heading, mid_hip, read_clip
from pose_sim.captured.session import camera_around, stamp_of
from pose_sim.captured.trackers import TRACKERS, at, track
from pose_sim.scene import SENSORS

ROOM_M = 1.7  # [m] half the side of the square in which people walk
WAY_M = 0.45  # [m] distance at which two people avoid each other
SPEED = (0.6, 1.4)  # [m/s]
AWAY_S = (1.0, 5.0)  # [s] duration of an absence
HIDES_M = 0.3  # [m] half width of a person who occludes another
APPEARS_S = 0.15  # [s] in view before a tracker detects a person again
SCALES = (0.86, 1.08)  # [-] range of the people's sizes, relative to the captured person
CAMERA_DISTANCE = 3.6  # [m] from the middle of the room
KEEPS_ID, NEW_ID = 0.5, 0.3  # [-] shares of the returns; in the rest, the occluding person's id


@dataclass(frozen=True, kw_only=True)
class CrowdSpec:
    """Definition of a scene."""

    clips: tuple[Path, ...]  # one per person
    seed: int
    duration_s: float = 60.0
    leaves: bool = True  # whether people leave the room


@dataclass(frozen=True, kw_only=True)
class CrowdFrame:
    """All persons in one camera's frame, with their true identities."""

    persons: tuple[SkeletonSample, ...]
    truth: tuple[int, ...]  # index of each person


@dataclass(frozen=True, kw_only=True)
class Crowd:
    """Measurements of the cameras, and the ground truth."""

    T_map_sensor: Mapping[str, FloatArray]  # (4, 4)
    frames: Sequence[CrowdFrame]  # in the order of their stamps


def make_crowd(spec: CrowdSpec) -> Crowd:
    """Simulate a scene; the same spec gives the same result."""
    rng = np.random.default_rng(spec.seed)
    count = round(spec.duration_s * RATE)
    paths = _paths(len(spec.clips), count, rng)
    scales = rng.permutation(np.linspace(*SCALES, len(spec.clips)))
    people = [
        _on_path(chain([read_clip(clip)] * 40, spec.duration_s), path, float(scale))
        for clip, path, scale in zip(spec.clips, paths, scales, strict=True)
    ]
    absences = [_absences(count, rng) if spec.leaves else np.zeros(count, bool) for _ in people]
    places = {sensor: _camera_pose(index, rng) for index, sensor in enumerate(SENSORS)}
    frames = [
        frame
        for sensor, place in places.items()
        for frame in _camera_frames(sensor, place, people, absences, rng)
    ]
    frames.sort(key=lambda frame: frame.persons[0].stamp_ns)
    return Crowd(T_map_sensor=places, frames=frames)


def _camera_pose(index: int, rng: np.random.Generator) -> FloatArray:
    angle = np.radians((-35.0, 35.0)[index]) + rng.uniform(-0.1, 0.1)
    return camera_around(angle, CAMERA_DISTANCE, rng.uniform(1.2, 1.8))


def _paths(people: int, count: int, rng: np.random.Generator) -> FloatArray:
    """Positions on the floor, (people, count, 2) [m]: between random goals, avoiding each other."""
    place = rng.uniform(-ROOM_M, ROOM_M, (people, 2))
    goal = rng.uniform(-ROOM_M, ROOM_M, (people, 2))
    speed = rng.uniform(*SPEED, people)
    paths = np.empty((people, count, 2))
    for step in range(count):
        arrived = np.linalg.norm(goal - place, axis=1) < 0.2
        goal[arrived] = rng.uniform(-ROOM_M, ROOM_M, (int(arrived.sum()), 2))
        velocity = goal - place
        velocity *= (speed / np.maximum(np.linalg.norm(velocity, axis=1), 1e-9))[:, None]
        apart = place[:, None] - place[None]
        distance = np.linalg.norm(apart, axis=2) + np.eye(people)
        push = np.maximum(WAY_M - distance, 0.0) / WAY_M * (1.0 - np.eye(people))
        velocity += (apart / distance[..., None] * push[..., None]).sum(axis=1) * 6.0
        place = place + velocity / RATE
        paths[:, step] = place
    return gaussian_filter1d(paths, 0.15 * RATE, axis=1, mode="nearest")


def _on_path(clip: Clip, path: FloatArray, scale: float) -> Clip:
    """The motion moved along a path, (m, 2) [m], facing its direction."""
    rows = np.arange(len(clip))
    rows = np.resize(np.concatenate([rows, rows[::-1]]), len(path))  # repeated to and fro
    positions = clip.positions[rows] * scale
    step = np.gradient(path, axis=0)
    yaw = np.unwrap(np.arctan2(step[:, 1], step[:, 0]))
    yaw = gaussian_filter1d(yaw, 0.2 * RATE) - np.unwrap(heading(positions))
    root = mid_hip(positions) * [1.0, 1.0, 0.0]
    turn = Rotation.from_euler("z", yaw[:, None])
    here = np.column_stack([path, np.zeros(len(path))])
    moved = [turn.apply(positions[:, j] - root) + here for j in range(positions.shape[1])]
    rotations = {name: turn * each[rows] for name, each in clip.rotations.items()}
    return Clip(name=clip.name, positions=np.stack(moved, axis=1), rotations=rotations)


def _absences(count: int, rng: np.random.Generator) -> BoolArray:
    """Mask of a person's absences, (count,)."""
    away = np.zeros(count, bool)
    start = round(rng.uniform(5.0, 15.0) * RATE)
    while start < count - 6 * RATE:
        length = round(rng.uniform(*AWAY_S) * RATE)
        away[start : start + length] = True
        start += length + round(rng.uniform(8.0, 20.0) * RATE)
    return away


def _camera_frames(
    sensor: str,
    place: FloatArray,
    people: Sequence[Clip],
    absences: Sequence[BoolArray],
    rng: np.random.Generator,
) -> list[CrowdFrame]:
    """Frames of one camera with all visible persons."""
    model = TRACKERS["mixed"]
    seed = int(rng.integers(2**31))
    # Frames are stamped by the first person's instants: others differ by up to one frame.
    seen = [
        track(clip.positions, place, model, np.random.default_rng([seed, 0, i]))
        for i, clip in enumerate(people)
    ]
    stamps = seen[0].stamps_s
    times = np.arange(len(people[0])) / RATE
    middles = np.stack([at(stamps, times, mid_hip(clip.positions)) for clip in people])
    visible = ~np.stack([np.interp(stamps, times, away) > 0.5 for away in absences])
    hider = _hiders(middles, place[:3, 3], visible)
    in_view = visible & (hider < 0)
    frames = []
    ids = _Ids(len(people), rng)
    for row, stamp_s in enumerate(stamps.tolist()):
        names = ids.named(in_view[:, row], hider[:, row])
        shown = [i for i in range(len(people)) if names[i] and row < len(seen[i].stamps_s)]
        shown = [int(i) for i in rng.permutation(shown)]
        if shown:
            samples = [seen[i].sample(row, stamp_of(stamp_s), sensor, names[i]) for i in shown]
            frames.append(CrowdFrame(persons=tuple(samples), truth=tuple(shown)))
    return frames


def _hiders(middles: FloatArray, camera: FloatArray, visible: BoolArray) -> NDArray[np.int_]:
    """Index of the person who occludes each person from a camera, (people, frames); -1 if none."""
    sight = middles - camera
    distance = np.linalg.norm(sight[..., :2], axis=2)
    hider = np.full(distance.shape, -1)
    for i, j in permutations(range(len(middles)), 2):
        cross = sight[i, :, 0] * sight[j, :, 1] - sight[i, :, 1] * sight[j, :, 0]
        beside = np.abs(cross) / distance[i]  # of the nearer person from the line of sight
        hides = (distance[j] < distance[i]) & (beside < HIDES_M) & visible[j]
        hider[i, hides & visible[i]] = j
    return hider


class _Ids:
    """Simulated ids of a tracker."""

    def __init__(self, people: int, rng: np.random.Generator) -> None:
        self._names = [""] * people
        self._former = [""] * people
        self._hider = [-1] * people
        self._in_view = np.zeros(people, int)
        self._rng = rng
        self._next = 1

    def named(self, in_view: BoolArray, hider: NDArray[np.int_]) -> list[str]:
        """The id of each person in view at this instant, empty for the others."""
        for i, sees in enumerate(in_view.tolist()):
            self._in_view[i] = self._in_view[i] + 1 if sees else 0
            if hider[i] >= 0:
                self._hider[i] = int(hider[i])
            if not sees and self._names[i]:
                self._former[i], self._names[i] = self._names[i], ""
            elif not self._names[i] and self._in_view[i] > APPEARS_S * 30.0:
                self._appear(i)
        return self._names

    def _appear(self, i: int) -> None:
        share, other = self._rng.random(), self._hider[i]
        self._hider[i] = -1
        if share < KEEPS_ID and self._former[i] and self._former[i] not in self._names:
            self._names[i] = self._former[i]
        elif share > KEEPS_ID + NEW_ID and other >= 0 and self._names[other] and self._former[i]:
            is_free = self._former[i] not in self._names
            swapped = self._former[i] if is_free else self._new()
            self._names[i], self._names[other] = self._names[other], swapped
        else:
            self._names[i] = self._new()

    def _new(self) -> str:
        self._next += 1
        return str(self._next - 1)
