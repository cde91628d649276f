"""Rotation of a limb about its long axis, from the plane of its bent hinge."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pose_core.kernels.compiling import compiled
from pose_core.kernels.rotations import turn_by
from pose_core.kernels.vectors import cross, dot, norm
from pose_core.streams.samples import FloatArray


class Hinges(NamedTuple):
    """A body's hinges as arrays, and how far they must be bent."""

    parents: NDArray[np.int64]
    links: NDArray[np.int64]
    signs: FloatArray
    straight: float  # sine of a flexion up to which the plane has no weight
    bent: float  # from which on it has full weight


@compiled
def turn_about_own_axis(R: FloatArray, angle: float) -> None:
    """Rotate a link, in place, by an angle [rad] about its own z axis, which may not be unit."""
    turn_by(angle * R[0, 2], angle * R[1, 2], angle * R[2, 2], R)


@compiled
def turn_into_hinge_planes(rotations: FloatArray, hinges: Hinges) -> None:
    """Rotate limbs about their long axes into their hinges' planes, in place.

    No bone changes its direction.

    Args:
        rotations: ``R_map_link``, (links, 3, 3).
        hinges: Of the body.
    """
    across = np.empty(3)
    for hinge in range(len(hinges.links)):
        upper, lower = rotations[hinges.parents[hinge]], rotations[hinges.links[hinge]]
        # Both bones run along −z: across = −sign (−lower z) × (−upper z).
        cross(lower[:, 2], upper[:, 2], across)
        sine = norm(across)
        bend = (sine - hinges.straight) / (hinges.bent - hinges.straight)
        share = min(max(bend, 0.0), 1.0)
        if share == 0.0:
            continue
        across *= -hinges.signs[hinge] / sine
        turn_about_own_axis(upper, share * angle_about_own_axis(upper, across))
        # The lower bone follows the hinge, with the least rotation about its long axis.
        turn_about_own_axis(lower, share * angle_about_own_axis(lower, upper[:, 1]))


@compiled
def angle_about_own_axis(R: FloatArray, lateral: FloatArray) -> float:
    """Rotation of a link about its z axis [rad] that brings its y axis to this one, (3,)."""
    turned = np.empty(3)
    cross(R[:, 1], lateral, turned)
    return np.arctan2(dot(turned, R[:, 2]), dot(R[:, 1], lateral))
