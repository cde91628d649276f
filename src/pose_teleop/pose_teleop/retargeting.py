"""A person as the 24 joints of SMPL, for humanoid retargeters.

SMPL has joints that are not measured: they are interpolated on the straight line between measured
ones, have the orientation of their segment, and are marked as not valid where they are assumed.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from pose_core.api import FloatArray

TOE = 0.13  # [m] from the ankle to the ball of the foot, forward
HAND = 0.08  # [m] from the wrist to the hand, along the forearm


@dataclass(frozen=True)
class _Rule:
    """Rule of one joint: between two frames, or ahead of one; with a link's orientation."""

    start: str
    turned_as: str
    end: str = ""  # empty: start
    share: float = 0.0  # fraction of the distance from start to end
    ahead: tuple[float, float, float] = (0.0, 0.0, 0.0)  # [m] in the link's axes
    is_guess: bool = False


def _limb_rules(side: str) -> dict[str, _Rule]:
    thigh, shank, ankle = f"{side}_thigh", f"{side}_shank", f"{side}_foot_joint"
    arm, forearm, wrist = f"{side}_upper_arm", f"{side}_forearm", f"{side}_hand_joint"
    return {
        f"{side}_hip": _Rule(thigh, thigh),
        f"{side}_knee": _Rule(shank, shank),
        f"{side}_ankle": _Rule(ankle, shank),
        f"{side}_foot": _Rule(ankle, shank, ahead=(TOE, 0.0, 0.0), is_guess=True),
        f"{side}_collar": _Rule("head", "trunk", arm, share=0.35, is_guess=True),
        f"{side}_shoulder": _Rule(arm, arm),
        f"{side}_elbow": _Rule(forearm, forearm),
        f"{side}_wrist": _Rule(wrist, forearm),
        f"{side}_hand": _Rule(wrist, forearm, ahead=(0.0, 0.0, -HAND), is_guess=True),
    }


SMPL = (
    *("pelvis", "left_hip", "right_hip", "spine1", "left_knee", "right_knee", "spine2"),
    *("left_ankle", "right_ankle", "spine3", "left_foot", "right_foot", "neck"),
    *("left_collar", "right_collar", "head", "left_shoulder", "right_shoulder"),
    *("left_elbow", "right_elbow", "left_wrist", "right_wrist", "left_hand", "right_hand"),
)
"""SMPL's 24 joints, in its order."""
_RULES_BY_NAME = {
    "pelvis": _Rule("body", "body"),
    "spine1": _Rule("body", "body", "trunk", share=0.5, is_guess=True),
    "spine2": _Rule("trunk", "trunk"),
    "spine3": _Rule("trunk", "trunk", "head", share=0.5, is_guess=True),
    "neck": _Rule("head", "trunk"),
    "head": _Rule("head", "head", "head_joint", share=0.5),
    **_limb_rules("left"),
    **_limb_rules("right"),
}
RULES = tuple(_RULES_BY_NAME[name] for name in SMPL)


@dataclass(frozen=True, kw_only=True)
class NamedPoses:
    """SMPL's 24 joints at one instant."""

    position: FloatArray  # [m] (24, 3)
    xyzw: FloatArray  # (24, 4) unit quaternions of the segments: identity in the N-pose
    is_valid: tuple[bool, ...]


def smpl_poses(
    names: Sequence[str], position: FloatArray, xyzw: FloatArray, subject: str, in_body: bool
) -> NamedPoses | None:
    """Compute the 24 joints from a person's frames; None if a frame is missing.

    Args:
        names: Names of n frames, the body's first.
        position: [m] (n, 3): the body in map, all others in the body.
        xyzw: Quaternions (n, 4) in the same frames.
        subject: The person's id, with which all names end.
        in_body: Whether the result is in the person's own frame; otherwise in map.
    """
    index = {name.removesuffix(f"_{subject}"): row for row, name in enumerate(names)}
    index.setdefault("trunk", 0)  # a body without a waist has no trunk frame
    wanted = {n for rule in RULES for n in (rule.start, rule.end or rule.start, rule.turned_as)}
    if wanted - index.keys():
        return None
    rotation = Rotation.from_quat(xyzw)
    body, origin = (Rotation.identity(), np.zeros(3)) if in_body else (rotation[0], position[0])
    places = np.vstack([origin, body.apply(position[1:]) + origin])
    turns = Rotation.concatenate([body, body * rotation[1:]])
    starts = places[[index[rule.start] for rule in RULES]]
    ends = places[[index[rule.end or rule.start] for rule in RULES]]
    turned: Rotation = turns[[index[rule.turned_as] for rule in RULES]]
    share = np.array([[rule.share] for rule in RULES])
    ahead = turned.apply(np.array([rule.ahead for rule in RULES]))
    joints = starts + share * (ends - starts) + ahead
    finite = np.isfinite(joints).all(axis=1)
    valid = (bool(ok and not rule.is_guess) for rule, ok in zip(RULES, finite, strict=True))
    return NamedPoses(position=joints, xyzw=turned.as_quat(), is_valid=tuple(valid))
