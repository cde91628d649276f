"""A limb's turn about itself that its bent hinge shows: the plane of the two bones.

A hinge bends in one plane only. Where it is well bent, the plane tells the turn of the upper bone
exactly; where it is straight, it tells nothing. In between, both share.
"""

import numpy as np

from pose_fusion.body.kinematics import rotation_from_vector
from pose_fusion.body.segment_tree import SegmentTree
from pose_fusion.streams.samples import FloatArray

STRAIGHT = np.sin(np.radians(10.0))  # [-] sine of a bend up to which the plane counts for nothing
BENT = np.sin(np.radians(30.0))  # [-] from which on it counts alone


def turned_into_hinge_planes(tree: SegmentTree, rotations: FloatArray) -> FloatArray:
    """Rotations whose limbs are turned about themselves as their hinges show.

    No bone changes its direction.

    Args:
        tree: The body.
        rotations: ``R_map_link``, shape (links, 3, 3).

    Returns:
        Shape (links, 3, 3).
    """
    result = rotations.copy()
    for hinge in tree.hinges:
        R_parent, R_link = result[hinge.parent], rotations[hinge.link]
        along, beyond = -R_parent[:, 2], -R_link[:, 2]
        across = -hinge.sign * np.cross(beyond, along)
        sine = float(np.linalg.norm(across))
        share = float(np.clip((sine - STRAIGHT) / (BENT - STRAIGHT), 0.0, 1.0))
        if share == 0.0:
            continue
        lateral = R_parent[:, 1]
        normal = across / sine
        angle = np.arctan2(
            float(np.cross(lateral, normal) @ R_parent[:, 2]), float(lateral @ normal)
        )
        result[hinge.parent] = rotation_from_vector(share * angle * R_parent[:, 2]) @ R_parent
        # The lower bone is where the hinge takes it, turned about itself as little as can be.
        result[hinge.link] = _with_lateral(result[hinge.parent][:, 1], R_link[:, 2], share, R_link)
    return result


def _with_lateral(
    lateral: FloatArray, along: FloatArray, share: float, R_link: FloatArray
) -> FloatArray:
    """The link turned about its own axis so that its y axis approaches ``lateral``."""
    sine = float(np.cross(R_link[:, 1], lateral) @ along)
    angle = float(np.arctan2(sine, float(R_link[:, 1] @ lateral)))
    return np.asarray(rotation_from_vector(share * angle * along) @ R_link)
