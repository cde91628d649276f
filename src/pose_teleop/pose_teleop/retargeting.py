"""A person as the 24 joints of SMPL, for humanoid retargeters.

SMPL has joints that are not measured: they are interpolated on the straight line between measured
ones, have the orientation of their segment, and are marked as not valid where they are assumed.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from pose_core.api import FloatArray
from pose_core.joints import SIDES
from pose_teleop.frame_tree import BodyPlaces

TOE = 0.13  # [m] from the ankle to the ball of the foot, forward
HAND = 0.08  # [m] from the wrist to the hand, along the forearm


@dataclass(frozen=True, kw_only=True)
class _Rule:
    """Rule of one joint: between two frames, or ahead of one; with a link's orientation."""

    name: str
    start: str
    end: str
    share: float = 0.0  # fraction of the distance from start to end
    turned_as: str
    ahead: tuple[float, float, float] = (0.0, 0.0, 0.0)  # [m] in the link's axes
    is_guess: bool = False


def _rules() -> tuple[_Rule, ...]:
    """The rules of all 24 joints, in SMPL's order."""
    found: dict[str, _Rule] = {}

    def add(name: str, start: str, turned_as: str, **more: object) -> None:
        end = str(more.pop("end", start))
        found[name] = _Rule(name=name, start=start, end=end, turned_as=turned_as, **more)  # type: ignore[arg-type]

    add("pelvis", "body", "body")
    add("spine1", "body", "body", end="trunk", share=0.5, is_guess=True)
    add("spine2", "trunk", "trunk")
    add("spine3", "trunk", "trunk", end="head", share=0.5, is_guess=True)
    add("neck", "head", "trunk")
    add("head", "head", "head", end="head_joint", share=0.5)
    for side in SIDES:
        add(f"{side}_hip", f"{side}_thigh", f"{side}_thigh")
        add(f"{side}_knee", f"{side}_shank", f"{side}_shank")
        add(f"{side}_ankle", f"{side}_foot_joint", f"{side}_shank")
        toe = {"ahead": (TOE, 0.0, 0.0), "is_guess": True}
        add(f"{side}_foot", f"{side}_foot_joint", f"{side}_shank", **toe)
        arm = f"{side}_upper_arm"
        add(f"{side}_collar", "head", "trunk", end=arm, share=0.35, is_guess=True)
        add(f"{side}_shoulder", arm, arm)
        add(f"{side}_elbow", f"{side}_forearm", f"{side}_forearm")
        add(f"{side}_wrist", f"{side}_hand_joint", f"{side}_forearm")
        hand = {"ahead": (0.0, 0.0, -HAND), "is_guess": True}
        add(f"{side}_hand", f"{side}_hand_joint", f"{side}_forearm", **hand)
    return tuple(found[name] for name in SMPL)


SMPL = (
    *("pelvis", "left_hip", "right_hip", "spine1", "left_knee", "right_knee", "spine2"),
    *("left_ankle", "right_ankle", "spine3", "left_foot", "right_foot", "neck"),
    *("left_collar", "right_collar", "head", "left_shoulder", "right_shoulder"),
    *("left_elbow", "right_elbow", "left_wrist", "right_wrist", "left_hand", "right_hand"),
)
"""SMPL's 24 joints, in its order."""
RULES = _rules()


@dataclass(frozen=True, kw_only=True)
class NamedPoses:
    """SMPL's 24 joints at one instant."""

    position: FloatArray  # [m] (24, 3)
    xyzw: FloatArray  # (24, 4) unit quaternions of the segments: identity in the N-pose
    is_valid: tuple[bool, ...]


def smpl_poses(places: BodyPlaces) -> NamedPoses | None:
    """Compute the 24 joints from a person's frames; None if a frame is missing."""
    # A body without a waist has no trunk frame.
    index = {"trunk": places.index.get("body", 0), **places.index}
    wanted = {n for rule in RULES for n in (rule.start, rule.end, rule.turned_as)}
    if wanted - index.keys():
        return None
    starts = places.position[[index[rule.start] for rule in RULES]]
    ends = places.position[[index[rule.end] for rule in RULES]]
    turned: Rotation = places.rotation[[index[rule.turned_as] for rule in RULES]]
    share = np.array([[rule.share] for rule in RULES])
    ahead = turned.apply(np.array([rule.ahead for rule in RULES]))
    position = starts + share * (ends - starts) + ahead
    finite = np.isfinite(position).all(axis=1)
    valid = (bool(ok and not rule.is_guess) for rule, ok in zip(RULES, finite, strict=True))
    return NamedPoses(position=position, xyzw=turned.as_quat(), is_valid=tuple(valid))
