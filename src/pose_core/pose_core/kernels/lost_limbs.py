"""Notices when a filter follows something that is not there: a limb, or the whole person."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pose_core.kernels.compiling import compiled, compiled_in_place
from pose_core.kernels.sources import NEVER
from pose_core.streams.samples import FloatArray

FAR = 25.0  # [-] squared Mahalanobis distance: 3 degrees of freedom, far beyond any outlier
PATIENCE_NS = 250_000_000  # [ns] for which a joint may be that far off
NONE, EVERYTHING = 0, -1
BODY = 0


class LimbNumbers(NamedTuple):
    """What is watched: the body, and each limb."""

    joints: NDArray[np.int64]  # (1 + limbs, most) of each; −1 beyond the last
    links: NDArray[np.bool_]  # (1 + limbs, links) that are forgotten with it


@compiled
def find_lost(
    limbs: LimbNumbers,
    since_ns: NDArray[np.int64],
    stamp_ns: int,
    distance: FloatArray,
    farthest: float,
) -> int:
    """Judge one update.

    Args:
        limbs: What is watched.
        since_ns: Since when each is far off [ns], NEVER if it is not; (1 + limbs,).
        stamp_ns: The update's instant [ns].
        distance: Squared Mahalanobis distance of each joint, (joints,); NaN unseen.
        farthest: The largest of them.

    Returns:
        What is lost: :data:`NONE`, :data:`EVERYTHING`, or a bit for each limb, from 1 on.
    """
    if not farthest >= FAR and np.all(since_ns == NEVER):  # nor of a NaN
        return NONE
    lost = 0
    for limb in range(len(since_ns)):
        if not has_been_far(limbs.joints[limb], since_ns, limb, stamp_ns, distance):
            continue
        if limb == BODY:
            since_ns[:] = NEVER
            return EVERYTHING
        since_ns[limb] = NEVER
        lost |= 1 << limb
    return lost


@compiled
def has_been_far(
    joints: NDArray[np.int64],
    since_ns: NDArray[np.int64],
    limb: int,
    stamp_ns: int,
    distance: FloatArray,
) -> bool:
    """Whether half of these joints, of those that are seen, have been far off for too long."""
    seen, count = np.empty(len(joints)), 0
    for joint in joints:
        if joint >= 0 and np.isfinite(distance[joint]):
            seen[count] = distance[joint]
            count += 1
    if count == 0:
        return False
    if np.median(seen[:count]) < FAR:
        since_ns[limb] = NEVER
        return False
    if since_ns[limb] == NEVER or stamp_ns < since_ns[limb]:
        since_ns[limb] = stamp_ns
    return stamp_ns - since_ns[limb] > PATIENCE_NS


@compiled_in_place
def forget(P: FloatArray, where: int, stddev: float) -> None:
    """Three errors from a place on are of that deviation, and go along with nothing."""
    for i in range(where, where + 3):
        for k in range(len(P)):
            P[i, k] = 0.0
            P[k, i] = 0.0
        P[i, i] = stddev**2
