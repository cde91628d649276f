"""Which joints tell that a limb is lost, or the whole person, and which links go with it."""

import numpy as np

from pose_core.body.model import BodyModel
from pose_core.joints import JOINT_INDEX
from pose_core.kernels.lost_limbs import LimbNumbers

BODY = ("neck", "torso", "left_shoulder", "right_shoulder", "left_hip", "right_hip")
LIMBS = (
    ("left_elbow", "left_hand"),
    ("right_elbow", "right_hand"),
    ("left_knee", "left_foot"),
    ("right_knee", "right_foot"),
)


def limb_numbers(model: BodyModel) -> LimbNumbers:
    """The body, and each limb: its joints and its links."""
    joints = np.full((1 + len(LIMBS), len(BODY)), -1, np.int64)
    links = np.zeros((1 + len(LIMBS), len(model.links)), np.bool_)
    for limb, names in enumerate((BODY, *LIMBS)):
        joints[limb, : len(names)] = [JOINT_INDEX[name] for name in names]
    for limb, names in enumerate(LIMBS, start=1):
        for index, link in enumerate(model.links.values()):
            links[limb, index] = link.joint is not None and model.ends(link.name)[1] in names
    return LimbNumbers(joints=joints, links=links)
