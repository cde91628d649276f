"""Chooses the frame from which the filter starts, by the sides that most cameras agree on.

A tracker that sees a person's back often takes it for the front and exchanges left and right. The
filter would take this for the truth and exchange the sides of all other cameras' frames. So it
starts once every camera has sent a frame, or after a short time, from a frame whose left and right
most others confirm. If two contradict each other, a person who faces away from the camera is
believed: trackers err in the other direction.
"""

from collections import deque

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.body.trunk import mid_hip, trunk_axes
from pose_core.estimates.observation import Observation
from pose_core.joints import JOINT_INDEX, SIDES
from pose_core.stamps import NS_PER_S

RECENT_NS = 3 * NS_PER_S // 20  # [ns] age up to which a camera's last frame counts
PATIENCE_NS = NS_PER_S // 10  # [ns] for which the start waits for other cameras
REMEMBERED = 10  # [observations] for each camera
PAIRS = np.array(
    [[JOINT_INDEX[f"{side}_{joint}"] for side in SIDES] for joint in ("hip", "shoulder")]
)


class StartFrames:
    """The last frame of each camera.

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
        recent = self._recent(stamp_ns)
        if not recent:
            return None, False
        if len(recent) < self._sensors:
            waited_ns = stamp_ns - min(frame[0] for frame in recent)
            if waited_ns < PATIENCE_NS:
                return None, True
        positions = np.array([frame[1] for frame in recent])
        left = positions[:, PAIRS[:, 0]] - positions[:, PAIRS[:, 1]]  # (frames, hips and shoulders)
        votes = np.sign(np.einsum("apx,bpx->abp", left, left)).sum(axis=(1, 2))
        votes += np.sign(np.einsum("ax,ax->a", left[:, 0], left[:, 1]))
        away = [_faces_away(frame[1], frame[2]) for frame in recent]
        stamps = [frame[0] for frame in recent]
        best = max(range(len(recent)), key=lambda row: (votes[row], away[row], stamps[row]))
        return positions[best], False

    def _recent(self, stamp_ns: int) -> list[tuple[int, FloatArray, FloatArray]]:
        """Stamp, joints and camera of the last frame of each camera that shows the trunk."""
        frames = {}
        for each in self._observations:
            if not 0 <= stamp_ns - each.stamp_ns <= RECENT_NS:
                continue
            for sensor, joints in enumerate(each.positions):
                if np.isfinite(joints[PAIRS]).all() and np.isfinite(trunk_axes(joints)).all():
                    frames[sensor] = (each.stamp_ns, joints, each.cameras[sensor])
        return list(frames.values())


def _faces_away(positions: FloatArray, camera: FloatArray) -> bool:
    """Whether a person shows this camera, (3,) [m] in map, the back; False if it is unknown."""
    return bool((camera - mid_hip(positions)) @ trunk_axes(positions)[:, 0] < 0.0)
