"""Degrees of freedom directly from joint positions, to initialise a filter.

The inverse of the chain R_y(−flexion) R_x(±abduction) R_z(∓rotation) of a limb: its direction gives
flexion and abduction, the next bone's direction gives rotation and the hinge's flexion.
"""

import numpy as np
from scipy.spatial.transform import Rotation

from pose_core.arrays import FloatArray
from pose_core.body.model import ROOT_DOF, BodyModel
from pose_core.body.trunk import mid_hip, trunk_axes
from pose_core.joints import JOINT_INDEX, LIMB_JOINTS, SIDE_SIGNS, SIDES
from pose_core.kernels.rotations import logarithm

STRAIGHT = np.radians(15.0)  # a straighter limb does not determine its axial rotation
BENDS = {"elbow": 1.0, "knee": -1.0}  # sign of a hinge's bend along x


def dof_from_positions(model: BodyModel, positions: FloatArray) -> FloatArray:
    """Estimate one pose's degrees of freedom.

    Args:
        model: Any model that has the limbs' degrees of freedom of li2020; further ones stay zero.
        positions: Joint positions [m] in map, shape (15, 3); a limb with a NaN joint stays
            neutral as far as it is not determined.

    Returns:
        Degrees of freedom [m], [rad], shape (d,); the root's rotation vector is zero, that is, the
        trunk's axes are its reference. NaN where the trunk is not determined.
    """
    R_map_body = trunk_axes(positions)
    dof = np.zeros(model.size)
    dof[:3] = mid_hip(positions)
    bones = {name: R_map_body.T @ positions[index] for name, index in JOINT_INDEX.items()}
    neck = bones["head"] - bones["neck"]
    # R_y(flexion) R_x(lateral bending) takes (0, 0, 1) to (sf cl, −sl, cf cl).
    x, y, z = neck / np.linalg.norm(neck)
    bending = -np.arcsin(np.clip(y, -1.0, 1.0))
    values = {"neck_flexion": np.arctan2(x, z), "neck_lateral_bending": bending}
    for side in SIDES:
        for ball, hinge, end in LIMB_JOINTS:
            first = bones[f"{side}_{hinge}"] - bones[f"{side}_{ball}"]
            second = bones[f"{side}_{end}"] - bones[f"{side}_{hinge}"]
            names = (f"{ball}_flexion", f"{ball}_abduction", f"{ball}_rotation", f"{hinge}_flexion")
            angles = _limb_angles(side, first, second, BENDS[hinge])
            values.update(zip((f"{side}_{name}" for name in names), angles, strict=True))
    for name, value in values.items():
        if name in model.dof_index and np.isfinite(value):
            dof[model.dof_index[name]] = value
    return dof


def dof_in_map(model: BodyModel, positions: FloatArray) -> FloatArray:
    """The same with the root's rotation vector in map."""
    dof = dof_from_positions(model, positions)
    dof[3:ROOT_DOF] = vector_from_rotation(trunk_axes(positions))
    return dof


def vector_from_rotation(R: FloatArray) -> FloatArray:
    """Rotation vector [rad] of a rotation matrix, shape (3, 3) to (3,), length at most π."""
    if not np.all(np.isfinite(R)):
        return np.full(3, np.nan)
    vector = np.empty(3)
    logarithm(np.ascontiguousarray(R, float), vector)
    return vector


def _limb_angles(side: str, first: FloatArray, second: FloatArray, bend: float) -> FloatArray:
    """Flexion, abduction, rotation and the hinge's flexion [rad] of one limb, (4,)."""
    outward = SIDE_SIGNS[side]
    x, y, z = first / np.linalg.norm(first)
    flexion = np.arctan2(x, -z)
    abduction = outward * np.arcsin(np.clip(y, -1.0, 1.0))
    swing = Rotation.from_euler("YX", (-flexion, outward * abduction)).as_matrix()
    across = swing.T @ (second / np.linalg.norm(second))
    hinge_flexion = np.arctan2(np.hypot(across[0], across[1]), -across[2])
    # The hinge moves the end along ±x of the limb, which determines the limb's axial rotation.
    about_z = np.arctan2(bend * across[1], bend * across[0])
    rotation = -outward * about_z if hinge_flexion > STRAIGHT else 0.0
    return np.array([flexion, abduction, rotation, hinge_flexion])
