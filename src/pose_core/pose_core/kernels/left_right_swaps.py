"""Left/right swaps: a tracker that exchanges the person's sides, detected and undone.

It happens when the person turns away or stands sideways, for the whole body or for only the legs or
arms, and the tracking states do not show it. Arms and legs are swapped back independently if this
brings the observed joints clearly nearer to the predicted ones; both, if this is so for one of
them, and hips and shoulders alike have their left where the prediction has the right.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pose_core.arrays import FloatArray
from pose_core.joints import JOINT_PAIRS, LIMB_JOINTS
from pose_core.kernels.compiling import compiled_in_place, compiled_into_caller

MIN_JOINTS = 3  # [-] observed joints of a group, below which its mean distance is not used


class SwapArrays(NamedTuple):
    """The groups of joints that may be swapped, and the two thresholds of a swap."""

    groups: NDArray[np.int64]  # (groups, n, 2) left and right joints
    far: float  # [m] mean distance as observed, above which a swap is considered
    clear: float  # [-] ratio of the distances, below which a group is swapped back


SWAPS = SwapArrays(
    groups=np.array([[JOINT_PAIRS[name] for name in limb] for limb in LIMB_JOINTS], np.int64),
    far=0.12,
    clear=0.5,
)


@compiled_into_caller
def mean_distance(
    observed: FloatArray, predicted: FloatArray, pairs: NDArray[np.int64], swapped: bool
) -> float:
    """Mean distance [m] of a group's observed joints from the predicted; NaN: too few observed.

    Args:
        observed: Joints [m], (15, 3); NaN where not observed.
        predicted: Joints [m], (15, 3).
        pairs: Left and right joints, (n, 2).
        swapped: Whether to exchange left and right.
    """
    total, count = 0.0, 0
    for pair in range(len(pairs)):
        for side in range(2):
            a = observed[pairs[pair, 1 - side if swapped else side]]
            b = predicted[pairs[pair, side]]
            squared = (a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2
            if np.isfinite(squared):
                total += np.sqrt(squared)
                count += 1
    return total / count if count >= MIN_JOINTS else np.nan


@compiled_into_caller
def are_opposed(observed: FloatArray, predicted: FloatArray, arrays: SwapArrays) -> bool:
    """Whether hips and shoulders alike have their left on the predicted right; false for NaN."""
    for group in range(len(arrays.groups)):
        left, right = arrays.groups[group, 0]
        cosine = 0.0
        for axis in range(3):
            cosine += (observed[left, axis] - observed[right, axis]) * (
                predicted[left, axis] - predicted[right, axis]
            )
        if not cosine < 0.0:
            return False
    return True


@compiled_into_caller
def is_swapped(observed: FloatArray, predicted: FloatArray, arrays: SwapArrays, group: int) -> bool:
    """Whether a group is clearly nearer to the prediction when it is swapped; false for NaN."""
    pairs = arrays.groups[group]
    as_observed = mean_distance(observed, predicted, pairs, False)
    if not as_observed > arrays.far:
        return False
    return mean_distance(observed, predicted, pairs, True) < arrays.clear * as_observed


@compiled_in_place
def undo_swaps(
    observed: FloatArray, predicted: FloatArray, arrays: SwapArrays, order: NDArray[np.int64]
) -> int:
    """Exchange the swapped groups in ``order``, (15,); return how many there are."""
    groups, found = len(arrays.groups), 0
    for group in range(groups):
        found += is_swapped(observed, predicted, arrays, group)
    if found == 0:
        return 0
    are_all = are_opposed(observed, predicted, arrays)
    for group in range(groups):
        if are_all or is_swapped(observed, predicted, arrays, group):
            for left, right in arrays.groups[group]:
                order[left], order[right] = order[right], order[left]
    return groups if are_all else found
