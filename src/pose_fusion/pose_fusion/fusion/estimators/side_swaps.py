"""A tracker that takes left for right: noticed by what is expected, and undone.

It happens when the person turns away or stands sideways, for a whole body or for the legs or arms
alone, and the joints' tracking states do not tell.
"""

import numpy as np
from numpy.typing import NDArray

from pose_common.joints import JOINT_INDEX, JOINTS, SIDES
from pose_fusion.streams.samples import FloatArray

CLEAR = 0.5  # [-] the swapped joints must lie this much nearer to what is expected
FAR = 0.12  # [m] joints that are nearer than this on average are not swapped
GROUPS = (("shoulder", "elbow", "hand"), ("hip", "knee", "foot"))


def _pairs(names: tuple[str, ...]) -> NDArray[np.int_]:
    return np.array([[JOINT_INDEX[f"{side}_{name}"] for side in SIDES] for name in names])


PAIRS = tuple(_pairs(names) for names in GROUPS)


def unswapped(seen: FloatArray, expected: FloatArray) -> tuple[NDArray[np.int_], int]:
    """The order of a sensor's joints that fits what is expected.

    Args:
        seen: Joint positions of one sensor [m], shape (15, 3); NaN unseen.
        expected: Where the joints should be [m], shape (15, 3).

    Returns:
        For each joint, the index of the seen joint that it is, shape (15,), and how many groups
        (arms, legs) had been swapped.
    """
    order = np.arange(len(JOINTS))
    count = 0
    for pairs in PAIRS:
        as_seen = _distance(seen[pairs], expected[pairs])
        if not as_seen > FAR:  # of NaN too
            continue
        if _distance(seen[pairs[:, ::-1]], expected[pairs]) < CLEAR * as_seen:  # false of NaN
            order[pairs] = order[pairs[:, ::-1]]
            count += 1
    return order, count


def _distance(seen: FloatArray, expected: FloatArray) -> float:
    apart = seen - expected
    distances = np.sqrt((apart * apart).sum(axis=-1))
    known = np.isfinite(distances)
    return float(distances[known].mean()) if known.sum() >= 3 else float("nan")
