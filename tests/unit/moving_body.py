"""A body that moves, for tests that need one: the same smooth motion at any rate."""

import numpy as np
from scipy.spatial.transform import Rotation

from pose_core.joints import JOINT_INDEX
from pose_core.streams.series import SkeletonSeries

S = 1_000_000_000
STANDING = {
    "head": (0, 0, 1.7),
    "neck": (0, 0, 1.5),
    "torso": (0, 0, 1.2),
    "shoulder": (0, 0.2, 1.45),
    "elbow": (0, 0.2, 1.15),
    "hand": (0, 0.2, 0.9),
    "hip": (0, 0.1, 0.95),
    "knee": (0, 0.1, 0.5),
    "foot": (0, 0.1, 0.1),
}


def standing(count):
    positions = np.zeros((count, 15, 3))
    for name, index in JOINT_INDEX.items():
        side, _, joint = name.partition("_")
        positions[:, index] = STANDING.get(name) or STANDING[joint]
        if side == "right":
            positions[:, index, 1] *= -1.0
    return positions


def raise_limb(positions, top, chain, angle, abduct):
    """Turn a limb about its top joint: in front (flexion), or to the left's outside."""
    axis = np.array([1.0, 0.0, 0.0]) if abduct else np.array([0.0, -1.0, 0.0])
    turn = Rotation.from_rotvec(angle[:, None] * axis)
    centre = positions[:, JOINT_INDEX[top]].copy()
    for joint in chain:
        index = JOINT_INDEX[joint]
        positions[:, index] = centre + turn.apply(positions[:, index] - centre)


def motion(rate=100.0, duration_s=12.0, begin_s=0.0):
    """Somebody raising a leg sideways, an arm in front and bending a knee, as a smooth function
    of time, so that it can be sampled at any instants."""
    times = begin_s + np.arange(0.0, duration_s, 1.0 / rate)
    positions = standing(len(times))
    raise_limb(positions, "right_knee", ["right_foot"], -0.6 + 0.6 * np.cos(2.1 * times), False)
    raise_limb(positions, "left_hip", ["left_knee", "left_foot"], 0.4 * np.sin(1.3 * times), True)
    arm = 1.0 - np.cos(1.7 * times)
    raise_limb(positions, "right_shoulder", ["right_elbow", "right_hand"], arm, False)
    return SkeletonSeries(
        stamps_ns=np.round(times * S).astype(np.int64),
        positions=positions,
        tracking_state=np.full((len(times), 15), 2, np.uint8),
    )
