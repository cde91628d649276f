"""Names shared by all packages: joints, segments, tracking states."""

from enum import IntEnum

SIDES = ("left", "right")
SIDE_SIGNS = {"left": 1.0, "right": -1.0}
"""Direction of each side along y, which points to the left."""

JOINTS: tuple[str, ...] = (
    "head",
    "neck",
    "torso",
    *(
        f"{side}_{joint}"
        for side in SIDES
        for joint in ("shoulder", "elbow", "hand", "hip", "knee", "foot")
    ),
)
"""The 15 joints of NiTE2, in the order of every (15, 3) array. ``left`` is the person's left."""

JOINT_INDEX: dict[str, int] = {name: index for index, name in enumerate(JOINTS)}

FARTHEST_M = 40.0  # [m] median distance of joints from a camera: none sees so far

LIMB_JOINTS = (("hip", "knee", "foot"), ("shoulder", "elbow", "hand"))
"""The joints of a leg and of an arm: ball joint, hinge, end."""

JOINT_PAIRS: dict[str, list[int]] = {
    joint: [JOINT_INDEX[f"{side}_{joint}"] for side in SIDES]
    for limb in LIMB_JOINTS
    for joint in limb
}
"""Indices of the left and the right joint of each kind."""

LEGS: tuple[tuple[int, ...], ...] = tuple(
    zip(*(JOINT_PAIRS[joint] for joint in LIMB_JOINTS[0]), strict=True)
)
"""Indices of hip, knee and foot of the left and of the right leg."""


def other_side(name: str) -> str:
    """The joint or segment of the other side; the same in the middle."""
    return name.replace("left", "#").replace("right", "left").replace("#", "right")


OTHER_SIDE: list[int] = [JOINT_INDEX[other_side(name)] for name in JOINTS]
"""Index of the joint of the other side, for each joint; of a middle joint, its own."""

SEGMENTS: tuple[str, ...] = (
    "pelvis",
    "torso",
    "head",
    *(
        f"{side}_{segment}"
        for side in SIDES
        for segment in ("upper_arm", "forearm", "hand", "thigh", "shank", "foot")
    ),
)
"""The body segments an IMU can be strapped to."""

LIMB_ENDS: dict[str, tuple[str, str]] = {
    f"{side}_{segment}": (f"{side}_{start}", f"{side}_{end}")
    for side in SIDES
    for segment, start, end in (
        ("upper_arm", "shoulder", "elbow"),
        ("forearm", "elbow", "hand"),
        ("thigh", "hip", "knee"),
        ("shank", "knee", "foot"),
    )
}
"""The joints at the ends of each segment of the limbs."""

SEGMENT_ENDS: dict[str, tuple[str, str]] = {"torso": ("torso", "neck"), **LIMB_ENDS}
"""The joints between which cameras observe a segment's direction."""

SKELETON_LINES: tuple[tuple[str, str], ...] = (
    *(("head", "neck"), ("neck", "torso")),
    *(("neck", f"{side}_shoulder") for side in SIDES),
    *(("torso", f"{side}_hip") for side in SIDES),
    *LIMB_ENDS.values(),
)
"""The joints between which a picture of a skeleton has a line."""


class TrackingState(IntEnum):
    """How a joint's position was obtained; the values of ``pose_msgs/Skeleton``."""

    NOT_TRACKED = 0
    INFERRED = 1
    TRACKED = 2
