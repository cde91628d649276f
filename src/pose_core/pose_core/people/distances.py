"""Distances between predicted persons and measured skeletons: the costs of the assignment."""

import numpy as np
from numpy.typing import NDArray

from pose_core.arrays import FloatArray
from pose_core.joints import OTHER_SIDE

FARTHEST_M = 1.0  # [m] a joint farther away is as wrong as one at this distance
LEAST_JOINTS = 4  # [-] in common
MIRRORED_M = 0.05  # [m] by which exchanged sides must agree better


def joint_distances(expected: FloatArray, seen: FloatArray) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Mean distance of the joints of each expected person and each seen skeleton.

    A tracker that sees a person from behind exchanges left and right: the better labelling counts.

    Args:
        expected: (p, 15, 3) [m]; NaN where unknown.
        seen: (s, 15, 3) [m] in the same frame; NaN where unknown.

    Returns:
        (p, s) [m], each joint :data:`FARTHEST_M` at most; infinite with too few joints in common.
        And whether the sides are exchanged, (p, s).
    """
    both = _mean_distances(expected, np.concatenate([seen, seen[:, OTHER_SIDE]]))
    plain, mirrored = both[:, : len(seen)], both[:, len(seen) :]
    is_mirrored = mirrored + MIRRORED_M < plain
    return np.where(is_mirrored, mirrored, plain), is_mirrored


def _mean_distances(expected: FloatArray, seen: FloatArray) -> FloatArray:
    distance = np.linalg.norm(expected[:, None] - seen[None], axis=3)
    known = np.isfinite(distance)
    count = known.sum(axis=2)
    total = np.where(known, np.minimum(distance, FARTHEST_M), 0.0).sum(axis=2)
    return np.asarray(np.where(count >= LEAST_JOINTS, total / np.maximum(count, 1), np.inf))
