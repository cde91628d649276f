"""Chooses the frame from which the filter starts, by the sides that most cameras agree on.

A tracker that sees a person's back often takes it for the front and exchanges left and right. The
filter would take this for the truth and exchange the sides of all other cameras' frames. So it
starts once every camera has sent a frame, or after a short time, from a frame whose left and right
most others confirm. If two contradict each other, a person who faces away from the camera is
believed: trackers err in the other direction.
"""

from collections import deque
from typing import NamedTuple

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.body.trunk import mid_hip, trunk_axes
from pose_core.estimates.observation import Observation
from pose_core.joints import JOINT_PAIRS
from pose_core.stamps import NS_PER_S

RECENT_NS = 3 * NS_PER_S // 20  # [ns] age up to which a camera's last frame counts
PATIENCE_NS = NS_PER_S // 10  # [ns] for which the start waits for other cameras
FORGOTTEN_NS = 2 * NS_PER_S  # [ns] age from which on frames are of an earlier time
REMEMBERED = 10  # [observations] for each camera
PAIRS = np.array([JOINT_PAIRS["hip"], JOINT_PAIRS["shoulder"]])


class _Frame(NamedTuple):
    stamp_ns: int
    sensor: int
    positions: FloatArray  # (15, 3) [m] in map
    camera: FloatArray  # (3,) [m] its position in map


class StartFrames:
    """The last frames of all cameras.

    Args:
        sensors: Number of cameras.
    """

    def __init__(self, sensors: int) -> None:
        self._sensors = sensors
        self._observations: deque[Observation] = deque(maxlen=REMEMBERED * sensors)

    def add(self, observation: Observation) -> None:
        """Remember an observation."""
        self._observations.append(observation)

    def choose(self, stamp_ns: int) -> tuple[FloatArray | None, bool]:
        """The joints to start from, (15, 3) [m] in map, and whether to wait for other cameras.

        Args:
            stamp_ns: The present instant [ns].
        """
        frames = self._frames(stamp_ns)
        newest = {frame.sensor: frame for frame in frames}.values()
        recent = [frame for frame in newest if stamp_ns - frame.stamp_ns <= RECENT_NS]
        if not recent:
            return None, False
        if len(recent) < self._sensors and stamp_ns - frames[0].stamp_ns < PATIENCE_NS:
            return None, True
        positions = np.array([frame.positions for frame in recent])
        left = positions[:, PAIRS[:, 0]] - positions[:, PAIRS[:, 1]]  # (frames, hips and shoulders)
        votes = np.sign(np.einsum("apx,bpx->abp", left, left)).sum(axis=(1, 2))
        votes += np.sign(np.einsum("ax,ax->a", left[:, 0], left[:, 1]))
        away = [_faces_away(frame) for frame in recent]
        stamps = [frame.stamp_ns for frame in recent]
        best = max(range(len(recent)), key=lambda row: (votes[row], away[row], stamps[row]))
        return positions[best], False

    def _frames(self, stamp_ns: int) -> list[_Frame]:
        """All frames that show the trunk, in the order of arrival."""
        return [
            _Frame(each.stamp_ns, sensor, joints, each.cameras[sensor])
            for each in self._observations
            if 0 <= stamp_ns - each.stamp_ns <= FORGOTTEN_NS
            for sensor, joints in enumerate(each.positions)
            if np.isfinite(joints[PAIRS]).all() and np.isfinite(trunk_axes(joints)).all()
        ]


def _faces_away(frame: _Frame) -> bool:
    """Whether the person shows the camera the back; False if it is unknown."""
    forwards = trunk_axes(frame.positions)[:, 0]
    return bool((frame.camera - mid_hip(frame.positions)) @ forwards < 0.0)
