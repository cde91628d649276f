"""N-pose: each tracker's offset at every joint of a standing person.

In the N-pose every joint angle is zero by definition: the limbs hang straight down, and the body is
symmetric. If a sensor observes a joint elsewhere, its tracker has a constant offset there.
"""

import itertools
from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pose_core.api import FloatArray, joint_angles
from pose_core.body.trunk import PAIRS, mid_hip, standing_heading
from pose_core.finite_numbers import nan_mean, nan_median, robust_stddev
from pose_core.joints import JOINT_INDEX, LIMB_JOINTS, SIDES, TrackingState
from pose_core.stamps import NS_PER_S

DURATION_NS = 3 * NS_PER_S // 2
CHECK_EVERY_NS = NS_PER_S // 5
LEAST_SAMPLES = 15  # [-] of a joint by a sensor
STILL_STDDEV = 0.03  # [m] a joint with a larger spread is moving
MOST_MOVING = 2  # [-] joints that may move: a tracker loses one now and then
BEND = np.radians(30.0)  # [rad] largest joint angle
ELBOW_BEND = np.radians(60.0)  # [rad] the same of elbows: partly occluded, hanging arms seem bent
LARGEST_OFFSET = 0.12  # [m] a larger deviation is a gross error, not an offset

TRACKER_ERROR = (0.03, 0.06)
"""[m] Up to the first mean distance from its neutral position, over all sensors, a joint's
deviation is the trackers' error; from the second on it is the person's posture."""
LEAST_SENSORS = 2  # [-] for this distinction; one sensor alone cannot make it


@dataclass(frozen=True, kw_only=True)
class NPose:
    """Result of the detection of the N-pose."""

    stamp_ns: int  # [ns] of its end
    offsets: FloatArray  # (sensors, 15, 3) [m] in heading axes (x forward, z up); zero where unseen


class NPoseDetector:
    """Detects the N-pose."""

    def __init__(self) -> None:
        self._samples: deque[tuple[int, FloatArray]] = deque()
        self._checked_ns = 0

    def add(
        self, stamp_ns: int, positions: FloatArray, tracking_state: NDArray[np.uint8]
    ) -> NPose | None:
        """Add the sensors' joints at one instant.

        Args:
            stamp_ns: The instant.
            positions: In map, shape (sensors, 15, 3) [m]; NaN where not observed.
            tracking_state: Shape (sensors, 15).

        Returns:
            The N-pose, once it has been held for long enough.
        """
        if self._samples and abs(stamp_ns - self._samples[-1][0]) > NS_PER_S:
            self._samples.clear()
        observed = (tracking_state != TrackingState.NOT_TRACKED)[..., None]
        self._samples.append((stamp_ns, np.where(observed, positions, np.nan)))
        while stamp_ns - self._samples[0][0] > DURATION_NS:
            self._samples.popleft()
        is_long = stamp_ns - self._samples[0][0] > 0.9 * DURATION_NS
        if not is_long or abs(stamp_ns - self._checked_ns) < CHECK_EVERY_NS:
            return None
        self._checked_ns = stamp_ns
        return self._n_pose(stamp_ns)

    def _n_pose(self, stamp_ns: int) -> NPose | None:
        views = np.stack([positions for _, positions in self._samples])  # (n, sensors, 15, 3)
        count = np.isfinite(views[..., 0]).sum(axis=0)
        with np.errstate(invalid="ignore"):
            median = np.where((count >= LEAST_SAMPLES)[..., None], nan_median(views), np.nan)
            spread = robust_stddev(views - median)
        moving = np.where(np.isfinite(spread), spread, np.inf).min(axis=0).max(axis=-1)
        if np.sum(moving > STILL_STDDEV) > MOST_MOVING:
            return None
        mean = nan_mean(median)
        if not np.all(np.isfinite(mean)) or not is_n_pose(mean):
            return None
        heading = about_z(standing_heading(mean))
        placed = (mean - mid_hip(mean)) @ heading
        neutral = n_pose_joints(placed)
        shift = np.mean(placed - neutral, axis=0)
        own = (median - mean) @ heading
        common = placed - shift - neutral
        nearest, farthest = TRACKER_ERROR
        distance = np.linalg.norm(common, axis=1, keepdims=True)
        share = np.clip((farthest - distance) / (farthest - nearest), 0.0, 1.0)
        share[np.isfinite(median[..., 0]).sum(axis=0) < LEAST_SENSORS] = 0.0
        offsets = own + share * common
        is_offset = np.linalg.norm(offsets, axis=-1) < LARGEST_OFFSET  # false of NaN
        return NPose(stamp_ns=stamp_ns, offsets=np.where(is_offset[..., None], offsets, 0.0))


def is_n_pose(joints: FloatArray) -> bool:
    """Whether joint positions, shape (15, 3) [m] in map, are those of the N-pose."""
    angles = joint_angles(joints[None])
    return all(abs(float(values[0])) < bend_limit(name) for name, values in angles.items())


def bend_limit(angle: str) -> float:
    """Largest value [rad] of a joint angle in the N-pose."""
    return float(ELBOW_BEND if "elbow_flexion" in angle else BEND)


def n_pose_joints(observed: FloatArray) -> FloatArray:
    """The exact N-pose of a body that is observed approximately in that pose.

    Args:
        observed: Joint positions in heading axes, from the middle of the hips, shape (15, 3) [m].

    Returns:
        Symmetric, trunk upright, limbs of the observed lengths straight down; shape (15, 3) [m].
    """
    mirror = np.array([1.0, -1.0, 1.0])
    symmetric = observed.copy()
    left, right = PAIRS.T
    symmetric[left] = 0.5 * (observed[left] + mirror * observed[right])
    symmetric[right] = mirror * symmetric[left]
    joints = symmetric.copy()
    for name in ("neck", "head", "torso"):
        joints[JOINT_INDEX[name], :2] = 0.0
    for side in SIDES:
        joints[JOINT_INDEX[f"{side}_hip"], [0, 2]] = 0.0
        joints[JOINT_INDEX[f"{side}_shoulder"], 0] = 0.0
        for limb in LIMB_JOINTS:
            for pair in itertools.pairwise(limb):
                upper, lower = (JOINT_INDEX[f"{side}_{name}"] for name in pair)
                length = np.linalg.norm(symmetric[lower] - symmetric[upper])
                joints[lower] = joints[upper] - [0.0, 0.0, length]
    return joints


def about_z(angle: FloatArray | float) -> FloatArray:
    """Rotation matrices of angles [rad] about z, shape (...) to (..., 3, 3)."""
    angle = np.asarray(angle, float)
    c, s, zero = np.cos(angle), np.sin(angle), np.zeros_like(angle)
    rows = ((c, -s, zero), (s, c, zero), (zero, zero, zero + 1.0))
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
