"""Pitch, yaw and roll of limbs in ``map``, as in zhang2015's figures 8 and 9, by its (3).

With d the direction of a limb from its upper to its lower joint: pitch = asin(d_z), −90° where it
hangs down; yaw = atan2(d_y, d_x); roll is the rotation about d. They are the angles of (3), pitch
with opposite sign, of a frame with x = d and y the segment's lateral axis. Yaw and roll are
undefined where the limb is nearly vertical. Roll needs segments' rotations, not only positions.
"""

from collections.abc import Sequence

import numpy as np

from pose_core.api import (
    BodyModel,
    FloatArray,
    ForwardKinematics,
    available_models,
    load_body_model,
)
from pose_core.arrays import unit_vectors
from pose_core.errors import InputError
from pose_core.joints import JOINT_INDEX, JOINTS
from pose_evaluation.stability import BONES

LIMBS: tuple[str, ...] = tuple(
    f"{side}_{bone}"
    for bone in ("upper_arm", "forearm", "thigh", "shank")
    for side in ("left", "right")
)
STEEP = np.radians(75.0)  # [rad] largest pitch with a defined yaw


def limb_attitude(positions: FloatArray, limb: str) -> tuple[FloatArray, FloatArray]:
    """Pitch and yaw [rad] of a limb, shape (n,) each; NaN where unknown.

    Args:
        positions: Joint positions [m] in ``map``, shape (n, 15, 3).
        limb: One of :data:`LIMBS`.

    Returns:
        Pitch in [−π/2, π/2]; yaw in (−π, π], NaN where the limb is steeper than 75°.
    """
    top, end = BONES[limb]
    x, y, z = unit_vectors(positions[:, JOINT_INDEX[end]] - positions[:, JOINT_INDEX[top]]).T
    pitch = np.arcsin(np.clip(z, -1.0, 1.0))
    return pitch, np.where(np.abs(pitch) > STEEP, np.nan, np.arctan2(y, x))


def limb_roll(R_map_segment: FloatArray) -> FloatArray:
    """Roll [rad] of a limb, shape (n,), in (−π, π]; NaN where the limb is steeper than 75°.

    Args:
        R_map_segment: The segment's rotations, (n, 3, 3); its z points up the limb.
    """
    direction, lateral = -R_map_segment[:, :, 2], R_map_segment[:, :, 1]
    upright = np.cross(direction, lateral)
    with np.errstate(invalid="ignore"):
        roll = np.arctan2(lateral[:, 2], upright[:, 2])  # zhang2015 (3)
        return np.where(np.abs(np.arcsin(np.clip(direction[:, 2], -1, 1))) > STEEP, np.nan, roll)


def model_of(dof_names: Sequence[str]) -> BodyModel | None:
    """The bundled body model with these degrees of freedom; None if there is none."""
    models = map(load_body_model, available_models())
    return next((model for model in models if model.dof_names == tuple(dof_names)), None)


def segment_rotations(dof_names: Sequence[str], dof: FloatArray, limb: str) -> FloatArray:
    """Rotations ``R_map_segment``, (n, 3, 3), of a limb.

    Args:
        dof_names: All degrees of freedom of one of the bundled body models, d of them.
        dof: Their values [m], [rad], (n, d).
        limb: One of :data:`LIMBS`.

    Raises:
        InputError: If no bundled body model has these degrees of freedom.
    """
    model = model_of(dof_names)
    if model is None:
        raise InputError(f"no body model has the degrees of freedom {', '.join(dof_names)}")
    rotations = ForwardKinematics(model, np.zeros((len(JOINTS), 3))).pose(dof).rotations
    return rotations[:, model.link_names.index(model.segments[limb])]
