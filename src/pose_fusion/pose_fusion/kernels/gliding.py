"""A correction taken over gradually: the arithmetic of ``fusion.estimators.handover``."""

from typing import NamedTuple

import numpy as np

from pose_fusion.kernels.compiling import compiled
from pose_fusion.kernels.placing import Pose
from pose_fusion.kernels.rotations import exponential, logarithm, product, product_transposed
from pose_fusion.streams.samples import FloatArray


class Limits(NamedTuple):
    """What may show at once."""

    turn: float  # [rad] of a link
    turn_time_s: float  # [s] of the link's own rate, by which that may be more
    shift: float  # [m] of the root
    shift_time_s: float  # [s] likewise, of its velocity


@compiled
def norm(v: FloatArray) -> float:
    """Length of a vector of three."""
    return np.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])


@compiled
def glide_beyond(missing: FloatArray, largest: float, gliding: FloatArray) -> float:
    """Update what glides: all that did, and of a new correction what is beyond a limit.

    Args:
        missing: Difference between what went out and the state, (3,).
        largest: New correction that may show at once.
        gliding: Of the difference, what was gliding already, (3,); becomes what is to glide.

    Returns:
        How much of the correction shows at once.
    """
    correction = missing - gliding
    share = max(0.0, 1.0 - largest / max(norm(correction), 1e-12))
    gliding += share * correction
    return norm(missing - gliding)


@compiled
def take_up(
    before: Pose,
    after: Pose,
    limits: Limits,
    turns: FloatArray,
    shift: FloatArray,
    at_once: FloatArray,
) -> None:
    """Take up a correction, in place.

    Args:
        before: The pose as predicted.
        after: As corrected.
        limits: What may show at once.
        turns: What glides, (links, 3) [rad] in map.
        shift: Likewise of the root, (3,) [m].
        at_once: What has shown at once since a pose went out: of each link [rad], of the root [m].
    """
    links = len(turns)
    turn, shown, apart, missing = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
    for link in range(links):
        v = turns[link]
        exponential(v[0], v[1], v[2], turn)
        product(turn, before.rotations[link], shown)
        # What would go out if nothing glided, against what went out.
        product_transposed(shown, after.rotations[link], apart)
        logarithm(apart, missing)
        largest = limits.turn + limits.turn_time_s * norm(before.rates[link])
        at_once[link] += glide_beyond(missing, max(largest - at_once[link], 0.0), v)
    missing[:] = before.position + shift - after.position
    largest = limits.shift + limits.shift_time_s * norm(before.velocity)
    at_once[links] += glide_beyond(missing, max(largest - at_once[links], 0.0), shift)


@compiled
def is_over(turns: FloatArray, shift: FloatArray, least_turn: float, least_shift: float) -> bool:
    """Whether all that glides is less than that [rad], [m]."""
    for link in range(len(turns)):
        if norm(turns[link]) >= least_turn:
            return False
    return norm(shift) < least_shift
