r"""Joint angles from joint positions, the same for every method (docs/conventions.md).

Lateral axis :math:`y = unit(left\_hip - right\_hip)`, up axis :math:`z` = the part of (neck −
mid-hip) orthogonal to it, :math:`x = y \times z`. A limb :math:`t` in these axes has

.. math:: flexion = atan2(t_x, -t_z), \quad abduction = asin(\pm t_y / |t|)

with + for the left; the knee's and the elbow's flexion is the angle between their two segments.
"""

import numpy as np

from pose_core.arrays import FloatArray, unit_vectors
from pose_core.body.trunk import trunk_axes
from pose_core.joints import JOINT_INDEX, LIMB_JOINTS, SIDE_SIGNS, SIDES

ANGLES: tuple[str, ...] = tuple(
    f"{side}_{angle}"
    for side in SIDES
    for angle in (
        "hip_flexion",
        "hip_abduction",
        "knee_flexion",
        "shoulder_flexion",
        "shoulder_abduction",
        "elbow_flexion",
    )
)
"""The twelve measured angles, in the order of every table."""

ABDUCTION_OF: dict[str, str] = {
    f"{side}_{joint}_flexion": f"{side}_{joint}_abduction"
    for side in SIDES
    for joint in ("hip", "shoulder")
}
"""The abduction beyond which flexion is undefined, because the limb points sideways."""


def joint_angles(positions: FloatArray) -> dict[str, FloatArray]:
    """Compute the twelve angles of a series of skeletons.

    Args:
        positions: Joint positions [m] in any right-handed frame, shape (n, 15, 3).

    Returns:
        Angles [rad] by name (:data:`ANGLES`), shape (n,) each: flexion of hip and shoulder in
        (−π, π], abduction in [−π/2, π/2], flexion of knee and elbow in [0, π]. NaN where a joint
        that it needs is NaN, or where joints coincide.
    """
    joints = {name: positions[:, index] for name, index in JOINT_INDEX.items()}
    axes = trunk_axes(positions)
    angles: dict[str, FloatArray] = {}
    for side in SIDES:
        outward = SIDE_SIGNS[side]
        for ball, hinge, end in LIMB_JOINTS:
            upper = joints[f"{side}_{hinge}"] - joints[f"{side}_{ball}"]
            lower = joints[f"{side}_{end}"] - joints[f"{side}_{hinge}"]
            x, y, z = np.einsum("nij,ni->nj", axes, unit_vectors(upper)).T
            angles[f"{side}_{ball}_flexion"] = np.arctan2(x, -z)
            angles[f"{side}_{ball}_abduction"] = np.arcsin(np.clip(outward * y, -1.0, 1.0))
            angles[f"{side}_{hinge}_flexion"] = _angle_between(upper, lower)
    return {name: angles[name] for name in ANGLES}


def wrapped(angle: FloatArray | float) -> FloatArray:
    """Angles [rad] of any shape modulo 2π, in [−π, π)."""
    return np.asarray((angle + np.pi) % (2.0 * np.pi) - np.pi)


def unwrapped(angle: FloatArray) -> FloatArray:
    """A series of angles [rad] without jumps of 2π, across NaN too, shape (n,)."""
    result = np.array(angle, float)
    known = np.isfinite(result)
    result[known] = np.unwrap(result[known])
    return result


def _norm(vectors: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.norm(vectors, axis=1))


def _angle_between(first: FloatArray, second: FloatArray) -> FloatArray:
    """Angle [rad] between vectors (n, 3); exact near 0 and π, where arccos is not."""
    sine, cosine = _norm(np.cross(first, second)), np.sum(first * second, axis=1)
    known = (_norm(first) > 0.0) & (_norm(second) > 0.0)
    return np.where(known, np.arctan2(sine, cosine), np.nan)
