"""A correction taken over gradually: the arithmetic of ``fusion.estimators.handover``."""

from typing import NamedTuple

import numpy as np

from pose_fusion.kernels.compiling import compiled
from pose_fusion.kernels.placing import Pose
from pose_fusion.kernels.rotations import exponential, logarithm, product, product_transposed
from pose_fusion.kernels.vectors import norm
from pose_fusion.streams.samples import FloatArray

NEGLIGIBLE_TURN = np.radians(0.05)  # [rad]
NEGLIGIBLE_SHIFT = 0.0005  # [m]


class Glide(NamedTuple):
    """What still lies between a state and what goes out for it."""

    turns: FloatArray  # (links, 3) [rad] in map: out = exp(turn) state
    shift: FloatArray  # (3,) [m] of the root


class Limits(NamedTuple):
    """What may show at once."""

    turn: float  # [rad] of a link
    turn_time_s: float  # [s] of the link's own rate, by which that may be more
    shift: float  # [m] of the root
    shift_time_s: float  # [s] likewise, of its velocity


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
    keep: float,
    glide: Glide,
    at_once: FloatArray,
) -> None:
    """Take up a correction, in place.

    Args:
        before: The pose as predicted.
        after: As corrected.
        limits: What may show at once.
        keep: What remains of the glide since it was changed last [-].
        glide: What glides.
        at_once: What has shown at once since a pose went out: of each link [rad], of the root [m].
    """
    turns, shift = glide.turns, glide.shift
    turns *= keep
    shift *= keep
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
def is_over(glide: Glide) -> bool:
    """Whether nothing glides that anybody would see."""
    for link in range(len(glide.turns)):
        if norm(glide.turns[link]) >= NEGLIGIBLE_TURN:
            return False
    return norm(glide.shift) < NEGLIGIBLE_SHIFT
