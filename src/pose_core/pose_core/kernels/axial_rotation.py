"""Axial rotation of a limb, from the plane of its bent hinge.

A hinge bends in one plane only. If it is well bent, the plane of the two bones determines the axial
rotation of the upper bone; if it is straight, the plane is undefined. In between, the plane has a
partial weight.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pose_core.arrays import FloatArray
from pose_core.kernels.compiling import compiled_into_caller
from pose_core.kernels.linear_algebra import cross, dot, norm
from pose_core.kernels.rotations import rotate_left

STRAIGHT = float(np.sin(np.radians(10.0)))  # [-] sine of a flexion: no weight below
BENT = float(np.sin(np.radians(30.0)))  # [-] sine of a flexion: full weight above


class Hinges(NamedTuple):
    """Links that only bend about their parents' lateral axes."""

    parents: NDArray[np.int64]  # (hinges,) index of the link
    links: NDArray[np.int64]  # (hinges,)
    signs: FloatArray  # (hinges,) of the rotation about +y that counts as flexion


@compiled_into_caller
def rotate_about_own_axis(R: FloatArray, angle: float) -> None:
    """Rotate a link, in place, by an angle [rad] about its own z axis, which may not be unit."""
    rotate_left(angle * R[0, 2], angle * R[1, 2], angle * R[2, 2], R)


@compiled_into_caller
def rotate_into_hinge_planes(rotations: FloatArray, hinges: Hinges) -> None:
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
        bend = (sine - STRAIGHT) / (BENT - STRAIGHT)
        share = min(max(bend, 0.0), 1.0)
        if share == 0.0:
            continue
        across *= -hinges.signs[hinge] / sine
        rotate_about_own_axis(upper, share * angle_about_own_axis(upper, across))
        # The lower bone follows the hinge, with the least rotation about its long axis.
        rotate_about_own_axis(lower, share * angle_about_own_axis(lower, upper[:, 1]))


@compiled_into_caller
def angle_about_own_axis(R: FloatArray, lateral: FloatArray) -> float:
    """Rotation of a link about its z axis [rad] that brings its y axis to this one, (3,)."""
    turned = np.empty(3)
    cross(R[:, 1], lateral, turned)
    return np.arctan2(dot(turned, R[:, 2]), dot(R[:, 1], lateral))
