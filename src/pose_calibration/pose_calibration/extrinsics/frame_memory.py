"""Frames stored by a calibration, distributed over the positions of the body."""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pose_core.api import AlignedFrame, Extrinsics, FloatArray, transformed
from pose_core.finite_numbers import are_known, nan_mean
from pose_core.joints import JOINT_INDEX, JOINT_PAIRS, JOINTS
from pose_core.stamps import NS_PER_S

CELL_M = 0.3  # [m] size of the cells of the body's position
PAUSE_NS = NS_PER_S  # [ns] a longer step between frames is a pause
KEPT_EVERY_NS = 50_000_000  # [ns] smallest interval between stored frames
MAX_KEPT_FRAMES = 900  # [-] 45 s
SPEED_OVER_NS = 150_000_000  # [ns] over which a joint's speed is computed, against noise
CENTRED_WITHIN_NS = 350_000_000  # [ns] longest span of two stored frames before to two after
UNKNOWN_SPEED = 0.5  # [m/s] of a joint without an earlier position
TRUNK = [JOINT_INDEX["neck"], JOINT_INDEX["torso"], *JOINT_PAIRS["shoulder"], *JOINT_PAIRS["hip"]]


@dataclass(frozen=True)
class KeptFrame:
    """One stored frame."""

    stamp_ns: int
    positions: FloatArray  # (sensors, 15, 3) [m], each in its sensor's frame; NaN if not TRACKED
    speeds: FloatArray  # (15,) [m/s], mean over the sensors


class FrameMemory:
    """Stores frames in which two or more sensors track the person; with one sensor, all frames.

    Memory is bounded: when it is full, every second frame is removed from the cell of the body's
    position with most frames, so that long standing does not displace short walking.

    Args:
        sensors: The sensors' names, in the order of the positions.
    """

    def __init__(self, sensors: Sequence[str]) -> None:
        self.sensors = tuple(sensors)
        count = len(self.sensors)
        self.shared_frames = np.zeros((count, count), int)  # with a common joint
        self.observed_s = 0.0  # [s] for which two sensors tracked the person
        self._cells: dict[tuple[int, ...], list[KeptFrame]] = {}
        self._kept_count = 0
        self._last_kept_ns: int | None = None
        self._last_ns: int | None = None
        self._recent: deque[KeptFrame] = deque()

    def add(self, frame: AlignedFrame) -> None:
        """Add the skeletons of all sensors at one instant."""
        positions = tracked_positions(frame, self.sensors)
        speeds = self._speeds_so_far(frame.stamp_ns, positions)
        is_known = are_known(positions)  # (sensors, joints)
        shared = (is_known[:, None] & is_known[None]).any(axis=2)
        self.shared_frames += shared
        # Sensors that have a joint in common with another one.
        others = shared & ~np.eye(len(shared), dtype=bool)
        together = shared[0] if len(self.sensors) == 1 else np.asarray(others.any(axis=1))
        if not together.any():
            return
        if self._last_ns is not None and 0 < frame.stamp_ns - self._last_ns < PAUSE_NS:
            self.observed_s += (frame.stamp_ns - self._last_ns) / NS_PER_S
        self._last_ns = frame.stamp_ns
        last_ns = self._last_kept_ns
        if last_ns is not None and 0 <= frame.stamp_ns - last_ns < KEPT_EVERY_NS:
            return
        self._last_kept_ns = frame.stamp_ns
        self._keep(KeptFrame(frame.stamp_ns, positions, speeds), together)

    def frames(self) -> list[KeptFrame]:
        """All stored frames in the order of time."""
        kept = (frame for cell in self._cells.values() for frame in cell)
        frames = sorted(kept, key=lambda frame: frame.stamp_ns)
        return [
            replace(frame, speeds=_speeds(before.stamp_ns, before.positions, after))
            if after.stamp_ns - before.stamp_ns <= CENTRED_WITHIN_NS
            else frame
            for before, frame, after in zip(
                frames[:2] + frames, frames, frames[2:] + frames[-2:], strict=False
            )
        ]

    def _speeds_so_far(self, stamp_ns: int, positions: FloatArray) -> FloatArray:
        """Speed of each joint [m/s] up to now, (15,)."""
        recent, now = self._recent, KeptFrame(stamp_ns, positions, np.empty(0))
        if recent and not 0 < stamp_ns - recent[-1].stamp_ns < PAUSE_NS:
            recent.clear()
        recent.append(now)
        while len(recent) > 2 and stamp_ns - recent[1].stamp_ns >= SPEED_OVER_NS:
            recent.popleft()
        return _speeds(recent[0].stamp_ns, recent[0].positions, now)

    def _keep(self, kept: KeptFrame, together: NDArray[np.bool_]) -> None:
        first = int(np.argmax(together))
        trunk = kept.positions[first, TRUNK]
        trunk = trunk[are_known(trunk)]
        place = np.floor(trunk.mean(axis=0) / CELL_M).astype(int) if len(trunk) else np.zeros(3)
        key = (*(int(number) for number in place), *(int(one) for one in together))
        self._cells.setdefault(key, []).append(kept)
        self._kept_count += 1
        if self._kept_count > MAX_KEPT_FRAMES:
            fullest = max(self._cells.values(), key=len)
            before = len(fullest)
            del fullest[1::2]
            self._kept_count -= before - len(fullest)


def tracked_positions(frame: AlignedFrame, sensors: Sequence[str]) -> FloatArray:
    """Joints [m] in each sensor's frame, (sensors, 15, 3); NaN if not TRACKED."""
    positions = np.full((len(sensors), len(JOINTS), 3), np.nan)
    for index, name in enumerate(sensors):
        if name in frame.samples:
            positions[index] = frame.samples[name].tracked
    return positions


def placed_positions(
    frame: AlignedFrame, sensors: Sequence[str], extrinsics: Extrinsics
) -> FloatArray:
    """The same in the reference's frame."""
    own = zip(sensors, tracked_positions(frame, sensors), strict=True)
    return np.stack([transformed(extrinsics.T_reference_sensor[name], each) for name, each in own])


def _speeds(before_ns: int, before: FloatArray, after: KeptFrame) -> FloatArray:
    """Speed of each joint [m/s] between two frames, mean over the sensors, (15,)."""
    if after.stamp_ns == before_ns:
        return np.full(len(JOINTS), UNKNOWN_SPEED)
    ways = nan_mean(np.linalg.norm(after.positions - before, axis=2))
    speeds = ways * NS_PER_S / (after.stamp_ns - before_ns)
    return np.where(np.isfinite(ways), speeds, UNKNOWN_SPEED)
