"""The segment filter's update, once what the cameras tell is gathered."""

import numpy as np

from pose_fusion.kernels.compiling import compiled
from pose_fusion.kernels.inverse import add_information
from pose_fusion.kernels.links import LinkLooks, add_imus, own_blocks, turn_back
from pose_fusion.kernels.placing import Pose
from pose_fusion.kernels.posture import PostureNumbers, add_posture
from pose_fusion.kernels.prediction import move
from pose_fusion.streams.samples import FloatArray

NOT_DEFINITE = -1


@compiled
def correct(
    posture: PostureNumbers,
    imus: LinkLooks,
    wrong_bend: float,
    informed: int,
    pose: Pose,
    P: FloatArray,
    information: FloatArray,
    vector: FloatArray,
    of_links: FloatArray,
) -> int:
    """Take the IMUs and the posture too, and move the pose, in place.

    Args:
        posture: What is known beforehand.
        imus: What the IMUs say, maybe of no link.
        wrong_bend: See :func:`pose_fusion.kernels.links.turn_back`.
        informed: How many of the error's first rows anything is told of.
        pose: The state.
        P: Its covariance.
        information: Of the cameras; is added to.
        vector: Likewise.
        of_links: Filled, (2, links, 3, 3): the cameras' and the IMUs' own of each link.

    Returns:
        How many limbs were turned back; :data:`NOT_DEFINITE` where the covariance has broken.
    """
    own_blocks(information, of_links[0])
    if len(imus.links) > 0:
        add_imus(pose, imus, information, vector)
        own_blocks(information, of_links[1])
        of_links[1] -= of_links[0]
    add_posture(posture, pose.rotations, information, vector)
    if not add_information(P, information, informed):
        return NOT_DEFINITE
    move(pose, np.dot(P, vector))
    hinges = (posture.hinge_parents, posture.hinge_links, posture.hinge_signs)
    return turn_back(pose.rotations, hinges[0], hinges[1], hinges[2], wrong_bend)
