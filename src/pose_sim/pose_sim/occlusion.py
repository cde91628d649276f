"""Self-occlusion: joints hidden from a camera by other parts of the body."""

from collections.abc import Iterable

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.joints import JOINTS, SIDES

SOFTNESS = 0.012  # [m] transition between visible and hidden
STAND_OFF = 0.04  # [m] distance before the joint that its own soft tissue covers

Mixture = dict[str, float]  # a point as a mean of joints
CAPSULES: dict[str, tuple[Mixture, Mixture, float]] = {
    "head": ({"head": 1.0}, {"head": 0.7, "neck": 0.3}, 0.055),
    **{
        f"{side}_{name}": ({f"{side}_{upper}": 1.0}, {f"{side}_{lower}": 1.0}, radius)
        for side in SIDES
        for name, upper, lower, radius in (
            ("upper_arm", "shoulder", "elbow", 0.027),
            ("forearm", "elbow", "hand", 0.022),
            ("thigh", "hip", "knee", 0.042),
            ("shank", "knee", "foot", 0.028),
        )
    },
    # Two capsules side by side model a trunk that is broader than deep.
    **{
        f"{side}_trunk": (
            {f"{side}_hip": 0.9, f"{other}_hip": 0.1},
            {f"{side}_shoulder": 0.68, f"{other}_shoulder": 0.32},
            0.063,
        )
        for side, other in (SIDES, SIDES[::-1])
    },
}
"""Ends and radius of each capsule, the radius as a fraction of the body height."""

OWN_CAPSULES: dict[str, tuple[str, ...]] = {
    "head": ("head",),
    "neck": ("head", "left_trunk", "right_trunk"),
    "torso": ("left_trunk", "right_trunk"),
    **{
        f"{side}_{joint}": tuple(
            capsule if capsule.endswith("trunk") else f"{side}_{capsule}" for capsule in own
        )
        for side in SIDES
        for joint, own in {
            "shoulder": ("left_trunk", "right_trunk", "upper_arm"),
            "elbow": ("upper_arm", "forearm"),
            "hand": ("forearm",),
            "hip": ("left_trunk", "right_trunk", "thigh"),
            "knee": ("thigh", "shank"),
            "foot": ("shank",),
        }.items()
    },
}
"""Capsules that contain each joint, which do not hide it."""


def _weights(mixtures: Iterable[Mixture]) -> FloatArray:
    rows = [[mixture.get(joint, 0.0) for joint in JOINTS] for mixture in mixtures]
    return np.array(rows)


_ENDS = (
    _weights(start for start, _, _ in CAPSULES.values()),
    _weights(end for _, end, _ in CAPSULES.values()),
)
_RADII = np.array([radius for _, _, radius in CAPSULES.values()])
_HIDES = np.array([[name not in OWN_CAPSULES[joint] for name in CAPSULES] for joint in JOINTS])


def hidden(joints: FloatArray, camera: FloatArray, height: float) -> FloatArray:
    """Degree to which each joint is hidden by other parts of the body.

    Args:
        joints: True joint positions [m], shape (n, 15, 3).
        camera: The camera's position [m] in the same frame, shape (3,).
        height: Body height [m], which scales the capsules.

    Returns:
        From 0 (in full view) to 1 (hidden), shape (n, 15).
    """
    starts, ends = (weights @ joints for weights in _ENDS)  # (n, K, 3)
    sight = joints - camera
    distance = np.linalg.norm(sight, axis=2, keepdims=True)
    sight = sight * (1.0 - STAND_OFF / distance)
    gaps = _segment_distances(camera, sight, starts, ends - starts)
    depth = np.where(_HIDES, height * _RADII - gaps, -1.0)  # [m] of the line of sight
    most = np.clip(depth.max(axis=2) / SOFTNESS, -30.0, 30.0)
    return 1.0 / (1.0 + np.exp(-2.0 * most))


def _segment_distances(
    camera: FloatArray, sight: FloatArray, starts: FloatArray, axes: FloatArray
) -> FloatArray:
    """Distance between every line of sight and every capsule's axis, shape (n, J, K).

    The nearest points ``camera + s sight`` and ``start + t axis`` with s and t in [0, 1]:
    Ericson (2005), Real-Time Collision Detection, 5.1.9.
    """
    between = camera - starts  # (n, K, 3)
    a = np.einsum("nji,nji->nj", sight, sight)[:, :, None]
    e = np.einsum("nki,nki->nk", axes, axes)[:, None, :]
    b = np.einsum("nji,nki->njk", sight, axes)
    c = np.einsum("nji,nki->njk", sight, between)
    f = np.einsum("nki,nki->nk", axes, between)[:, None, :]
    g = np.einsum("nki,nki->nk", between, between)[:, None, :]
    s = np.clip((b * f - c * e) / np.maximum(a * e - b * b, 1e-12), 0.0, 1.0)
    t = np.clip((b * s + f) / e, 0.0, 1.0)
    s = np.clip((b * t - c) / a, 0.0, 1.0)
    squared = g + a * s * s + e * t * t + 2.0 * (c * s - f * t - b * s * t)
    return np.sqrt(np.maximum(squared, 0.0))
