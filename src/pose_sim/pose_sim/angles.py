"""True joint angles by ``docs/conventions.md``: from positions, and of the body itself."""

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.joints import SIDES
from pose_sim.motion import Motion

AXIAL_ROTATIONS = tuple(
    f"{side}_{joint}_rotation" for side in SIDES for joint in ("shoulder", "hip")
)
"""Angles that follow from no position."""


def true_joint_angles(motion: Motion) -> dict[str, FloatArray]:
    """True angles [rad] of the default body model's joints, on the motion's grid, (n,) each.

    Flexions and abductions of shoulders, elbows, hips and knees are computed from the true
    positions, flexions continuous over time. Rotations of upper arms and thighs are the body's own,
    relative to trunk and pelvis. Neck and waist are the rotations of head and trunk relative to
    their parents, decomposed as ``R_y(flexion) R_x(lateral_bending) R_z(rotation)``.
    """
    # Loads numba, which virtual IMUs do without.
    from pose_core.api import joint_angles, load_body_model

    angles = joint_angles(motion.pose.joints)
    for name in angles:
        if name.endswith(("shoulder_flexion", "hip_flexion")):
            angles[name] = np.unwrap(angles[name])
    angles |= {name: motion.angles[name] for name in AXIAL_ROTATIONS}
    rotations = motion.pose.rotations
    for part, parent, child in (("neck", "torso", "head"), ("waist", "pelvis", "torso")):
        relative = np.swapaxes(rotations[parent], 1, 2) @ rotations[child]
        angles[f"{part}_flexion"] = np.arctan2(relative[:, 0, 2], relative[:, 2, 2])
        angles[f"{part}_lateral_bending"] = -np.arcsin(np.clip(relative[:, 1, 2], -1.0, 1.0))
        angles[f"{part}_rotation"] = np.arctan2(relative[:, 1, 0], relative[:, 1, 1])
    return {name: angles[name] for name in load_body_model("default").angle_names}
