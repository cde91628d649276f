"""Poses of the drawn parts from a skeleton's joints and, if known, its links' rotations.

A limb's direction is that of its bone. Its axial rotation comes from the link's rotation; without
one, it is the smallest rotation from its parent's axes. The trunk's parts follow from hips, torso
joint, neck and shoulders.
"""

from collections.abc import Mapping

import numpy as np
from scipy.spatial.transform import Rotation

from pose_core.api import FloatArray, skew
from pose_core.arrays import unit_vectors
from pose_core.joints import JOINT_INDEX, LIMB_ENDS, SIDES
from pose_view.body.parts import PARTS

DOWN = np.array([0.0, 0.0, -1.0])
UPPER = tuple(f"{side}_{limb}" for side in SIDES for limb in ("upper_arm", "thigh"))
LOWER = tuple(f"{side}_{limb}" for side in SIDES for limb in ("forearm", "shank"))
CARRIERS = {
    f"{side}_{limb}": carrier
    for side in SIDES
    for limb, carrier in (
        *(("upper_arm", "thorax"), ("forearm", f"{side}_upper_arm")),
        *(("thigh", "pelvis"), ("shank", f"{side}_thigh")),
    )
}
"""The part from which each limb has its axial rotation where no link gives it."""
OPPOSITE = -1.0 + 1e-6  # [-] cosine below which the smallest rotation has no unique axis


def part_poses(
    joints: FloatArray, rotations: Mapping[str, FloatArray] | None = None
) -> tuple[FloatArray, FloatArray]:
    """Origin and rotation of each part.

    Args:
        joints: Joint positions [m], shape (15, 3).
        rotations: ``R_map_link``, (3, 3), of the known links, by part name.

    Returns:
        Positions (11, 3) [m] and rotations ``R_map_part`` (11, 3, 3), in the order of
        :data:`PARTS`; NaN where a joint is.
    """
    rotations = rotations or {}
    at = {name: joints[index] for name, index in JOINT_INDEX.items()}
    hips = 0.5 * (at["left_hip"] + at["right_hip"])
    turned = {
        "pelvis": _axes(at["torso"] - hips, at["left_hip"] - at["right_hip"]),
        "thorax": _axes(at["neck"] - at["torso"], at["left_shoulder"] - at["right_shoulder"]),
    }
    origins = {"pelvis": hips, "thorax": at["torso"], "head": at["neck"]}
    turned["head"] = _swung(
        rotations.get("head", turned["thorax"])[None], -(at["head"] - at["neck"])[None]
    )[0]
    for level in (UPPER, LOWER):
        bones = []
        for part in level:
            start, end = (at[joint] for joint in LIMB_ENDS[part])
            origins[part] = start
            bones.append(end - start)
        carried = np.stack([rotations.get(part, turned[CARRIERS[part]]) for part in level])
        turned.update(zip(level, _swung(carried, np.stack(bones)), strict=True))
    return (np.stack([origins[part] for part in PARTS]), np.stack([turned[part] for part in PARTS]))


def quaternions(rotations: FloatArray) -> FloatArray:
    """(w, x, y, z) of rotation matrices, (n, 3, 3) to (n, 4); unit for NaN."""
    known = np.asarray(np.isfinite(rotations).all(axis=(1, 2)))
    matrices = np.where(known[:, None, None], rotations, np.eye(3))
    return np.asarray(Rotation.from_matrix(matrices).as_quat()[:, [3, 0, 1, 2]])


def _axes(up: FloatArray, left: FloatArray) -> FloatArray:
    """The rotation with z along ``up`` and y as near to ``left`` as possible."""
    with np.errstate(invalid="ignore", divide="ignore"):
        z = up / np.linalg.norm(up)
        y = left - (left @ z) * z
        y = y / np.linalg.norm(y)
    return np.stack([np.cross(y, z), y, z], axis=1)


def _swung(rotations: FloatArray, bones: FloatArray) -> FloatArray:
    """Rotations (n, 3, 3), changed by the smallest rotation so that −z is along bones (n, 3)."""
    now, wanted = rotations @ DOWN, unit_vectors(bones)
    cross, cosine = np.cross(now, wanted), np.sum(now * wanted, axis=1)
    K = skew(cross)
    # Rodrigues: sin θ and (1 − cos θ) of a unit axis, in terms of the cross product itself.
    turn = np.eye(3) + K + K @ K / (1.0 + np.maximum(cosine, OPPOSITE))[:, None, None]
    opposite = cosine <= OPPOSITE
    turn[opposite] = (
        rotations[opposite] @ np.diag([-1.0, 1.0, -1.0]) @ np.swapaxes(rotations[opposite], 1, 2)
    )
    return turn @ rotations
