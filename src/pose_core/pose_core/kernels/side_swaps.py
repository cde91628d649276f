"""Left taken for right: noticed by distances, see :mod:`pose_core.filters.side_swaps`."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pose_core.kernels.compiling import compiled, compiled_in_place
from pose_core.kernels.placing import BodyNumbers, Pose, place_joints
from pose_core.streams.samples import FloatArray

LEAST_JOINTS = 3  # of a group, for a distance to mean something


class SwapNumbers(NamedTuple):
    """Which joints may be swapped, and when they are taken to be."""

    groups: NDArray[np.int64]  # (groups, n, 2) left and right joints
    far: float  # [m] by which the joints must be off
    clear: float  # [-] of that distance, below which they must be once swapped


@compiled_in_place
def mean_distance(
    seen: FloatArray, expected: FloatArray, pairs: NDArray[np.int64], swapped: bool
) -> float:
    """How far the joints of both sides are from where they should be [m]; NaN: too few are seen.

    Args:
        seen: Joints [m], (15, 3); NaN unseen.
        expected: Where they should be [m], (15, 3).
        pairs: Left and right joints, (n, 2).
        swapped: Whether to take left for right.
    """
    total, count = 0.0, 0
    for pair in range(len(pairs)):
        for side in range(2):
            a = seen[pairs[pair, 1 - side if swapped else side]]
            b = expected[pairs[pair, side]]
            squared = (a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2
            if np.isfinite(squared):
                total += np.sqrt(squared)
                count += 1
    return total / count if count >= LEAST_JOINTS else np.nan


@compiled_in_place
def unswap(
    seen: FloatArray, expected: FloatArray, numbers: SwapNumbers, order: NDArray[np.int64]
) -> int:
    """Swap back the groups in ``order``, (15,), that fit better; how many."""
    count = 0
    for group in range(len(numbers.groups)):
        pairs = numbers.groups[group]
        as_seen = mean_distance(seen, expected, pairs, False)
        if not as_seen > numbers.far:  # of NaN too
            continue
        if mean_distance(seen, expected, pairs, True) < numbers.clear * as_seen:  # false of NaN
            for left, right in pairs:
                order[left], order[right] = order[right], order[left]
            count += 1
    return count


@compiled
def unswap_cameras(
    body: BodyNumbers,
    pose: Pose,
    numbers: SwapNumbers,
    positions: FloatArray,
    tracking_state: NDArray[np.uint8],
) -> int:
    """Swap back, in place, what each camera's tracker took for the other side's.

    Args:
        body: The tree.
        pose: What is expected.
        numbers: Which joints, and when.
        positions: (s, 15, 3) [m]; NaN unseen.
        tracking_state: (s, 15).

    Returns:
        How many groups were.
    """
    count, swaps = positions.shape[1], 0
    levers, expected = np.zeros((count, len(pose.rotations), 3)), np.empty((count, 3))
    place_joints(body, pose.position, pose.rotations, pose.slides, levers, expected)
    for s in range(len(positions)):
        order = np.arange(count)
        swapped = unswap(positions[s], expected, numbers, order)
        if swapped > 0:
            positions[s] = positions[s][order]
            tracking_state[s] = tracking_state[s][order]
            swaps += swapped
    return swaps
