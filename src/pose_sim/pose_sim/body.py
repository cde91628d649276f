"""The synthetic body: segments of given lengths, a bending spine, moving clavicles.

This model differs from those of the filters: its trunk has two bending parts above the pelvis, and
its shoulders are attached to clavicles, so that a filter's kinematic tree never fits it exactly, as
it never fits a person.

Lengths are fractions of the body height after Winter (2009), Biomechanics and Motor Control of
Human Movement, 4th ed., fig. 4.1 (from Drillis and Contini, 1966); the positions of joint centres
inside the trunk, which the figure does not give, have plausible values. The joints ``hand`` and
``foot`` are wrist and ankle, as published by ``kinect_bridge``.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.joints import JOINTS, SEGMENTS, SIDE_SIGNS, SIDES
from pose_sim.rotations import about_x, about_y, about_z

PROXIMAL_JOINTS = {
    "upper_arm": "shoulder",
    "forearm": "elbow",
    "hand": "hand",
    "thigh": "hip",
    "shank": "knee",
    "foot": "foot",
}
"""The joint about which each segment of the limbs rotates, without the side."""
BODY_ANGLES: tuple[str, ...] = (
    *("pelvis_yaw", "pelvis_tilt", "pelvis_obliquity"),
    *(
        f"{part}_{angle}"
        for part in ("lumbar", "thoracic", "neck")
        for angle in ("flexion", "lateral_bending", "rotation")
    ),
    *(
        f"{side}_{angle}"
        for side in SIDES
        for angle in (
            *("clavicle_elevation", "clavicle_protraction"),
            *("shoulder_flexion", "shoulder_abduction", "shoulder_rotation"),
            *("elbow_flexion", "forearm_rotation"),
            *("hip_flexion", "hip_abduction", "hip_rotation", "knee_flexion", "ankle_flexion"),
        )
    ),
)
"""Every angle of the body; all are zero in the neutral pose. ``ankle_flexion`` is
relative to a level foot."""

# Fractions of the body height.
ANKLE_HEIGHT = 0.039  # Winter (2009) fig. 4.1
SHANK = 0.246  # Winter (2009) fig. 4.1: 0.285 - 0.039
THIGH = 0.245  # Winter (2009) fig. 4.1: 0.530 - 0.285
UPPER_ARM = 0.186  # Winter (2009) fig. 4.1
FOREARM = 0.146  # Winter (2009) fig. 4.1
FOOT = 0.152  # Winter (2009) fig. 4.1
HIP_HALF_DISTANCE = 0.050  # between joint centres, inside Winter's hip width 0.191
SHOULDER_HALF_DISTANCE = 0.110  # between joint centres, inside Winter's shoulder width 0.259
SHOULDER_DROP = 0.012  # neck to shoulders: 0.830 - 0.818 (Winter)
LUMBAR_RISE = 0.050  # mid-hip to the joint between pelvis and lumbar spine
LUMBAR = 0.100  # to the joint between lumbar and thoracic spine
THORACIC = 0.150  # to the neck
HEAD = 0.100  # neck to the middle of the head
SPINE_BEHIND = 0.020  # the spine's joints lie behind the line from mid-hip to neck

CONTACT_SOFTNESS = 0.008  # [m] over which the load moves from one point of a foot to another


@dataclass(frozen=True, kw_only=True)
class BodyPoses:
    """Poses of a body at n instants, in ``map``."""

    joints: FloatArray  # (n, 15, 3) [m]
    rotations: Mapping[str, FloatArray]  # segment: R_map_segment, (n, 3, 3)
    origins: Mapping[str, FloatArray]  # segment: its proximal joint, (n, 3) [m]
    contacts: FloatArray  # (n, 4, 3) [m] left heel, left ball, right heel, right ball


@dataclass(frozen=True)
class Body:
    """A person of a given height.

    Args:
        height: Body height [m].
    """

    height: float = 1.75  # [m]
    offsets: Mapping[str, FloatArray] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "offsets", _offsets(self.height))

    def pose(self, angles: Mapping[str, FloatArray]) -> BodyPoses:
        """Forward kinematics, midway between the hips at the origin.

        Args:
            angles: Angles [rad] by their names in :data:`BODY_ANGLES`, shape (n,) each.

        Returns:
            All joints, segments and foot contacts; segments' axes are parallel to the pelvis' in
            the neutral pose: x forward, y left, z up.
        """
        count = len(angles["pelvis_yaw"])
        pelvis = about_z(angles["pelvis_yaw"]) @ about_y(angles["pelvis_tilt"])
        pelvis = pelvis @ about_x(angles["pelvis_obliquity"])
        builder = _Builder(self.offsets)
        builder.place("pelvis", pelvis, np.zeros((count, 3)))
        builder.chain("pelvis", "lumbar", _spine(angles, "lumbar"))
        builder.chain("lumbar", "torso", _spine(angles, "thoracic"))
        builder.chain("torso", "head", _spine(angles, "neck"))
        for side, sign in SIDE_SIGNS.items():
            _arm(builder, angles, side, sign)
            _leg(builder, angles, side, sign)
        return builder.pose()

    def contact_height(self, contacts: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Height of the lowest contact point, and each point's share of the load.

        Args:
            contacts: Points under the feet [m], shape (n, 4, 3).

        Returns:
            The lowest height [m], shape (n,), smooth where the contact changes between points, and
            the shares, shape (n, 4), that sum to one.
        """
        heights = contacts[..., 2]
        shares = np.exp(-(heights - heights.min(axis=1, keepdims=True)) / CONTACT_SOFTNESS)
        shares /= shares.sum(axis=1, keepdims=True)
        return np.sum(shares * heights, axis=1), shares


def neutral_angles(count: int) -> dict[str, FloatArray]:
    """All angles zero, at ``count`` instants."""
    return {name: np.zeros(count) for name in BODY_ANGLES}


def _offsets(height: float) -> dict[str, FloatArray]:
    """Points in the frames of segments [m]; by a segment's name, its origin in its parent."""
    fractions: dict[str, tuple[float, float, float]] = {
        "lumbar": (-SPINE_BEHIND, 0.0, LUMBAR_RISE),
        "torso": (0.0, 0.0, LUMBAR),
        "head": (SPINE_BEHIND, 0.0, THORACIC),
        "joint_torso": (SPINE_BEHIND, 0.0, 0.0),
        "joint_head": (0.0, 0.0, HEAD),
        "heel": (-0.25 * FOOT, 0.0, -ANKLE_HEIGHT),
        "ball": (0.48 * FOOT, 0.0, -ANKLE_HEIGHT),
        "shank": (0.0, 0.0, -THIGH),
        "foot": (0.0, 0.0, -SHANK),
        "forearm": (0.0, 0.0, -UPPER_ARM),
        "hand": (0.0, 0.0, -FOREARM),
    }
    inner = 0.012  # sternal end of the clavicle, from the midline
    forward, below = 0.015, 0.020  # of the neck
    shoulder = SHOULDER_HALF_DISTANCE - inner
    for side, sign in SIDE_SIGNS.items():
        fractions[f"{side}_thigh"] = (0.0, sign * HIP_HALF_DISTANCE, 0.0)
        fractions[f"{side}_clavicle"] = (SPINE_BEHIND + forward, sign * inner, THORACIC - below)
        fractions[f"{side}_upper_arm"] = (-forward, sign * shoulder, below - SHOULDER_DROP)
    return {name: height * np.asarray(point) for name, point in fractions.items()}


def _spine(angles: Mapping[str, FloatArray], part: str) -> FloatArray:
    return (
        about_y(angles[f"{part}_flexion"])
        @ about_x(angles[f"{part}_lateral_bending"])
        @ about_z(angles[f"{part}_rotation"])
    )


def _ball_joint(angles: Mapping[str, FloatArray], joint: str, sign: float) -> FloatArray:
    return (
        about_y(-angles[f"{joint}_flexion"])
        @ about_x(sign * angles[f"{joint}_abduction"])
        @ about_z(-sign * angles[f"{joint}_rotation"])
    )


def _arm(builder: "_Builder", angles: Mapping[str, FloatArray], side: str, sign: float) -> None:
    elevation = about_x(sign * angles[f"{side}_clavicle_elevation"])
    protraction = about_z(-sign * angles[f"{side}_clavicle_protraction"])
    builder.chain("torso", f"{side}_clavicle", protraction @ elevation)
    # The clavicle moves the shoulder's position; the arm's angles are relative to the trunk.
    shoulder = builder.point(f"{side}_clavicle", builder.offsets[f"{side}_upper_arm"])
    upper_arm = builder.rotations["torso"] @ _ball_joint(angles, f"{side}_shoulder", sign)
    builder.place(f"{side}_upper_arm", upper_arm, shoulder)
    elbow = about_y(-angles[f"{side}_elbow_flexion"])
    pronation = about_z(-sign * angles[f"{side}_forearm_rotation"])
    builder.chain(f"{side}_upper_arm", f"{side}_forearm", elbow @ pronation, "forearm")
    builder.chain(f"{side}_forearm", f"{side}_hand", None, "hand")


def _leg(builder: "_Builder", angles: Mapping[str, FloatArray], side: str, sign: float) -> None:
    builder.chain("pelvis", f"{side}_thigh", _ball_joint(angles, f"{side}_hip", sign))
    knee = angles[f"{side}_knee_flexion"]
    builder.chain(f"{side}_thigh", f"{side}_shank", about_y(knee), "shank")
    level = knee - angles[f"{side}_hip_flexion"] + angles["pelvis_tilt"]
    ankle = about_y(-level - angles[f"{side}_ankle_flexion"])
    builder.chain(f"{side}_shank", f"{side}_foot", ankle, "foot")


class _Builder:
    """Builds a pose segment by segment."""

    def __init__(self, offsets: Mapping[str, FloatArray]) -> None:
        self.offsets = offsets
        self.rotations: dict[str, FloatArray] = {}
        self.origins: dict[str, FloatArray] = {}

    def place(self, segment: str, rotation: FloatArray, origin: FloatArray) -> None:
        self.rotations[segment] = rotation
        self.origins[segment] = origin

    def chain(
        self, parent: str, segment: str, rotation: FloatArray | None, offset: str = ""
    ) -> None:
        turned = self.rotations[parent] if rotation is None else self.rotations[parent] @ rotation
        self.place(segment, turned, self.point(parent, self.offsets[offset or segment]))

    def point(self, segment: str, offset: FloatArray) -> FloatArray:
        return self.origins[segment] + self.rotations[segment] @ offset

    def pose(self) -> BodyPoses:
        joints = {
            "head": self.point("head", self.offsets["joint_head"]),
            "neck": self.origins["head"],
            "torso": self.point("torso", self.offsets["joint_torso"]),
            **{
                f"{side}_{joint}": self.origins[f"{side}_{segment}"]
                for side in SIDES
                for segment, joint in PROXIMAL_JOINTS.items()
            },
        }
        contacts = [
            self.point(f"{side}_foot", self.offsets[point])
            for side in SIDES
            for point in ("heel", "ball")
        ]
        return BodyPoses(
            joints=np.stack([joints[name] for name in JOINTS], axis=1),
            rotations={segment: self.rotations[segment] for segment in SEGMENTS},
            origins={segment: self.origins[segment] for segment in SEGMENTS},
            contacts=np.stack(contacts, axis=1),
        )
