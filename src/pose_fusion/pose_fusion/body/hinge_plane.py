"""A limb's turn about itself that its bent hinge shows: the plane of the two bones.

A hinge bends in one plane only. Where it is well bent, the plane tells the turn of the upper bone
exactly; where it is straight, it tells nothing. In between, both share.
"""

import numpy as np

from pose_fusion.body.segment_tree import SegmentTree
from pose_fusion.kernels.hinge_plane import turn_into_hinge_planes
from pose_fusion.streams.samples import FloatArray

STRAIGHT = float(np.sin(np.radians(10.0)))  # [-] sine of a bend: up to it the plane says nothing
BENT = float(np.sin(np.radians(30.0)))  # [-] from which on it counts alone


def turned_into_hinge_planes(tree: SegmentTree, rotations: FloatArray) -> FloatArray:
    """Rotations whose limbs are turned about themselves as their hinges show.

    No bone changes its direction.

    Args:
        tree: The body.
        rotations: ``R_map_link``, shape (links, 3, 3).

    Returns:
        Shape (links, 3, 3).
    """
    result = np.array(rotations, order="C")
    parents, links, signs = tree.hinge_arrays
    turn_into_hinge_planes(result, parents, links, signs, STRAIGHT, BENT)
    return result
