"""The turn of a limb about itself that its bent hinge shows: see ``body.hinge_plane``."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pose_fusion.kernels.compiling import compiled
from pose_fusion.kernels.rotations import exponential, product
from pose_fusion.streams.samples import FloatArray


class Hinges(NamedTuple):
    """A body's hinges as arrays, and how far they must be bent; see below."""

    parents: NDArray[np.int64]
    links: NDArray[np.int64]
    signs: FloatArray
    straight: float
    bent: float


@compiled
def turn_about_own_axis(R: FloatArray, angle: float) -> None:
    """Turn a link, in place, by an angle [rad] about its own z axis, which may not be unit."""
    turn, before = np.empty((3, 3)), R.copy()
    exponential(angle * R[0, 2], angle * R[1, 2], angle * R[2, 2], turn)
    product(turn, before, R)


@compiled
def turn_into_hinge_planes(
    rotations: FloatArray,
    parents: NDArray[np.int64],
    links: NDArray[np.int64],
    signs: FloatArray,
    straight: float,
    bent: float,
) -> None:
    """Turn limbs about themselves, in place; no bone changes its direction.

    Args:
        rotations: ``R_map_link``, (links, 3, 3).
        parents: Of each hinge.
        links: Of each hinge.
        signs: Of each hinge.
        straight: Sine of a bend up to which the plane counts for nothing.
        bent: From which on it counts alone.
    """
    for hinge in range(len(links)):
        upper, lower = rotations[parents[hinge]], rotations[links[hinge]]
        # Both bones run along −z: across = −sign (−lower z) × (−upper z).
        across = -signs[hinge] * np.cross(lower[:, 2], upper[:, 2])
        sine = np.sqrt((across**2).sum())
        share = min(max((sine - straight) / (bent - straight), 0.0), 1.0)
        if share == 0.0:
            continue
        normal = across / sine
        turned = np.cross(upper[:, 1], normal)
        angle = np.arctan2((turned * upper[:, 2]).sum(), (upper[:, 1] * normal).sum())
        turn_about_own_axis(upper, share * angle)
        # The lower bone is where the hinge takes it, turned about itself as little as can be.
        turned = np.cross(lower[:, 1], upper[:, 1])
        angle = np.arctan2((turned * lower[:, 2]).sum(), (lower[:, 1] * upper[:, 1]).sum())
        turn_about_own_axis(lower, share * angle)
