"""Joint angles by ``docs/conventions.md``: computed from positions, and of the body itself.

Independent of the fusion's own implementation, so that tests can compare the two.
"""

from collections.abc import Mapping

import numpy as np

from pose_core.joints import JOINT_INDEX, SIDES
from pose_sim.motion import Motion
from pose_sim.rotations import FloatArray

JOINT_NAMES: tuple[str, ...] = (
    "neck_flexion",
    "neck_lateral_bending",
    *(
        f"{side}_{angle}"
        for side in SIDES
        for angle in (
            "shoulder_flexion",
            "shoulder_abduction",
            "shoulder_rotation",
            "elbow_flexion",
            "hip_flexion",
            "hip_abduction",
            "hip_rotation",
            "knee_flexion",
        )
    ),
    "waist_flexion",
    "waist_lateral_bending",
    "waist_rotation",
)
"""The joints of the 27-DOF model, in its order."""

LIMBS = {"shoulder": ("elbow", "hand", "elbow"), "hip": ("knee", "foot", "knee")}
"""Ball joint: the joints down its limb, and the hinge's name."""


def measured_angles(joints: FloatArray) -> dict[str, FloatArray]:
    """Compute flexions and abductions from joint positions.

    Args:
        joints: Positions of the 15 joints [m] in any frame, shape (n, 15, 3).

    Returns:
        Twelve angles [rad] by name, shape (n,) each, in (-π, π]; NaN where a joint is.
    """

    def joint(name: str) -> FloatArray:
        return joints[:, JOINT_INDEX[name]]

    mid_hip = 0.5 * (joint("left_hip") + joint("right_hip"))
    y = _unit(joint("left_hip") - joint("right_hip"))
    up = joint("neck") - mid_hip
    z = _unit(up - _dot(up, y)[:, None] * y)
    x = np.cross(y, z)
    angles: dict[str, FloatArray] = {}
    for side, sign in zip(SIDES, (1.0, -1.0), strict=True):
        for ball, (middle, end, hinge) in LIMBS.items():
            upper = joint(f"{side}_{middle}") - joint(f"{side}_{ball}")
            lower = joint(f"{side}_{end}") - joint(f"{side}_{middle}")
            length = np.linalg.norm(upper, axis=1)
            angles[f"{side}_{ball}_flexion"] = np.arctan2(_dot(upper, x), -_dot(upper, z))
            sine = sign * _dot(upper, y) / length
            angles[f"{side}_{ball}_abduction"] = np.arcsin(np.clip(sine, -1.0, 1.0))
            cosine = _dot(_unit(upper), _unit(lower))
            angles[f"{side}_{hinge}_flexion"] = np.arccos(np.clip(cosine, -1.0, 1.0))
    return angles


def true_joint_angles(motion: Motion) -> dict[str, FloatArray]:
    """True angles [rad] for each of :data:`JOINT_NAMES`, on the motion's grid, shape (n,) each.

    Flexions and abductions of shoulders, elbows, hips and knees are computed from the true
    positions, flexions continuous over time. Rotations of upper arms and thighs are the body's own,
    relative to trunk and pelvis. Neck and waist are the rotations of head and trunk relative to
    their parents, decomposed as ``R_y(flexion) R_x(lateral_bending) R_z(rotation)``.
    """
    angles = measured_angles(motion.pose.joints)
    for name in angles:
        if name.endswith(("shoulder_flexion", "hip_flexion")):
            angles[name] = np.unwrap(angles[name])
    for side in SIDES:
        for name in (f"{side}_shoulder_rotation", f"{side}_hip_rotation"):
            angles[name] = motion.angles[name]
    rotations: Mapping[str, FloatArray] = motion.pose.rotations
    for part, parent, child in (("neck", "torso", "head"), ("waist", "pelvis", "torso")):
        relative = np.swapaxes(rotations[parent], 1, 2) @ rotations[child]
        angles[f"{part}_flexion"] = np.arctan2(relative[:, 0, 2], relative[:, 2, 2])
        angles[f"{part}_lateral_bending"] = -np.arcsin(np.clip(relative[:, 1, 2], -1.0, 1.0))
        angles[f"{part}_rotation"] = np.arctan2(relative[:, 1, 0], relative[:, 1, 1])
    return {name: angles[name] for name in JOINT_NAMES}


def _unit(vectors: FloatArray) -> FloatArray:
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def _dot(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.einsum("ni,ni->n", a, b)
