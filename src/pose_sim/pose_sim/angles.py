"""True joint angles by ``docs/conventions.md``: from positions, and of the body itself."""

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.joints import SIDES
from pose_sim.motion import Motion

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


def true_joint_angles(motion: Motion) -> dict[str, FloatArray]:
    """True angles [rad] for each of :data:`JOINT_NAMES`, on the motion's grid, shape (n,) each.

    Flexions and abductions of shoulders, elbows, hips and knees are computed from the true
    positions, flexions continuous over time. Rotations of upper arms and thighs are the body's own,
    relative to trunk and pelvis. Neck and waist are the rotations of head and trunk relative to
    their parents, decomposed as ``R_y(flexion) R_x(lateral_bending) R_z(rotation)``.
    """
    from pose_core.api import joint_angles  # loads numba, which virtual IMUs do without

    angles = joint_angles(motion.pose.joints)
    for name in angles:
        if name.endswith(("shoulder_flexion", "hip_flexion")):
            angles[name] = np.unwrap(angles[name])
    for side in SIDES:
        for name in (f"{side}_shoulder_rotation", f"{side}_hip_rotation"):
            angles[name] = motion.angles[name]
    rotations = motion.pose.rotations
    for part, parent, child in (("neck", "torso", "head"), ("waist", "pelvis", "torso")):
        relative = np.swapaxes(rotations[parent], 1, 2) @ rotations[child]
        angles[f"{part}_flexion"] = np.arctan2(relative[:, 0, 2], relative[:, 2, 2])
        angles[f"{part}_lateral_bending"] = -np.arcsin(np.clip(relative[:, 1, 2], -1.0, 1.0))
        angles[f"{part}_rotation"] = np.arctan2(relative[:, 1, 0], relative[:, 1, 1])
    return {name: angles[name] for name in JOINT_NAMES}
