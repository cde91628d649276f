"""Axial rotation of a limb from the plane of its bent hinge.

A hinge bends in one plane only. If it is well bent, the plane of the two bones determines the axial
rotation of the upper bone; if it is straight, the plane is undefined. In between, the plane has a
partial weight.
"""

import numpy as np

from pose_core.body.segment_tree import SegmentTree
from pose_core.kernels.axial_rotation import Hinges

STRAIGHT = float(np.sin(np.radians(10.0)))  # [-] sine of a flexion: no weight below
BENT = float(np.sin(np.radians(30.0)))  # [-] sine of a flexion: full weight above


def hinges_of(tree: SegmentTree) -> Hinges:
    """The hinges whose planes determine the axial rotation of limbs."""
    parents, links, signs = tree.hinge_arrays
    return Hinges(parents=parents, links=links, signs=signs, straight=STRAIGHT, bent=BENT)
