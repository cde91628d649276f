"""A limb's turn about itself that its bent hinge shows: the plane of the two bones.

A hinge bends in one plane only. Where it is well bent, the plane tells the turn of the upper bone
exactly; where it is straight, it tells nothing. In between, both share.
"""

import numpy as np

from pose_core.body.segment_tree import SegmentTree
from pose_core.kernels.hinge_plane import Hinges

STRAIGHT = float(np.sin(np.radians(10.0)))  # [-] sine of a bend: up to it the plane says nothing
BENT = float(np.sin(np.radians(30.0)))  # [-] from which on it counts alone


def hinges_of(tree: SegmentTree) -> Hinges:
    """The hinges by whose planes limbs are turned about themselves; no bone changes direction."""
    parents, links, signs = tree.hinge_arrays
    return Hinges(parents=parents, links=links, signs=signs, straight=STRAIGHT, bent=BENT)
