"""A correction taken over gradually: the arithmetic of ``fusion.estimators.handover``."""

from typing import NamedTuple

import numpy as np

from pose_core.kernels.compiling import compiled, compiled_in_place
from pose_core.kernels.placing import Pose
from pose_core.kernels.rotations import logarithm, product_transposed, turn_by
from pose_core.kernels.vectors import norm
from pose_core.streams.samples import FloatArray

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


@compiled_in_place
def glide_beyond(missing: FloatArray, largest: float, gliding: FloatArray) -> float:
    """Update what glides: all that did, and of a new correction what is beyond a limit.

    Args:
        missing: Difference between what went out and the state, (3,).
        largest: New correction that may show at once.
        gliding: Of the difference, what was gliding already, (3,); becomes what is to glide.

    Returns:
        How much of the correction shows at once.
    """
    squared = 0.0
    for axis in range(3):
        squared += (missing[axis] - gliding[axis]) ** 2
    correction = np.sqrt(squared)
    share = max(0.0, 1.0 - largest / max(correction, 1e-12))
    for axis in range(3):
        gliding[axis] += share * (missing[axis] - gliding[axis])
    return (1.0 - share) * correction


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
    shown, apart, missing = np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
    for link in range(len(glide.turns)):
        take_up_link(before, after, link, limits, keep, glide, at_once, shown, apart, missing)
    take_up_root(before, after, limits, keep, glide, at_once, missing)


@compiled_in_place
def take_up_link(
    before: Pose,
    after: Pose,
    link: int,
    limits: Limits,
    keep: float,
    glide: Glide,
    at_once: FloatArray,
    shown: FloatArray,
    apart: FloatArray,
    missing: FloatArray,
) -> None:
    """One link's; the last three are room for two matrices and a vector."""
    v = glide.turns[link]
    for i in range(3):
        v[i] *= keep
        for k in range(3):
            shown[i, k] = before.rotations[link, i, k]
    turn_by(v[0], v[1], v[2], shown)
    # What would go out if nothing glided, against what went out.
    product_transposed(shown, after.rotations[link], apart)
    logarithm(apart, missing)
    largest = limits.turn + limits.turn_time_s * norm(before.rates[link])
    at_once[link] += glide_beyond(missing, max(largest - at_once[link], 0.0), v)


@compiled_in_place
def take_up_root(
    before: Pose,
    after: Pose,
    limits: Limits,
    keep: float,
    glide: Glide,
    at_once: FloatArray,
    missing: FloatArray,
) -> None:
    """The root's; the last is room for a vector."""
    shift, root = glide.shift, len(glide.turns)
    for axis in range(3):
        shift[axis] *= keep
        missing[axis] = before.position[axis] + shift[axis] - after.position[axis]
    largest = limits.shift + limits.shift_time_s * norm(before.velocity)
    at_once[root] += glide_beyond(missing, max(largest - at_once[root], 0.0), shift)


@compiled_in_place
def is_over(glide: Glide) -> bool:
    """Whether nothing glides that anybody would see."""
    for link in range(len(glide.turns)):
        if norm(glide.turns[link]) >= NEGLIGIBLE_TURN:
            return False
    return norm(glide.shift) < NEGLIGIBLE_SHIFT
