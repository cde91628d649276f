"""Self-occlusion: the degree to which the predicted body hides each joint from a camera.

The body is a set of capsules between joints. A joint is hidden if the line of sight to it passes
through a capsule that it does not belong to.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pose_core.arrays import FloatArray
from pose_core.joints import JOINT_INDEX, JOINTS, SIDES
from pose_core.kernels.compiling import compiled_in_place, compiled_into_caller
from pose_core.kernels.linear_algebra import dot

SOFTNESS = 0.02  # [m] width of the transition from visible to hidden
STAND_OFF = 0.06  # [m] end of the line of sight, next to the joint, that is ignored
CUTOFF_WIDTHS = 6.0  # [-] transition widths beyond which a capsule hides nothing
TRUNK_RADIUS, SPINE_RADIUS = 0.10, 0.11  # [m]


class Capsules(NamedTuple):
    """The parts of the body as capsules."""

    ends: NDArray[np.int64]  # (capsules, 2) joints
    radius: FloatArray  # (capsules,) [m]
    hides: NDArray[np.bool_]  # (joints, capsules) whether a joint can be hidden by a capsule


def make_capsules() -> Capsules:
    """Capsules of an adult."""
    parts: dict[str, tuple[str, str, float]] = {
        "head": ("head", "neck", 0.10),
        "spine": ("torso", "neck", SPINE_RADIUS),
    }
    for side in SIDES:
        parts[f"{side}_upper_arm"] = (f"{side}_shoulder", f"{side}_elbow", 0.05)
        parts[f"{side}_forearm"] = (f"{side}_elbow", f"{side}_hand", 0.04)
        parts[f"{side}_thigh"] = (f"{side}_hip", f"{side}_knee", 0.075)
        parts[f"{side}_shank"] = (f"{side}_knee", f"{side}_foot", 0.05)
        parts[f"{side}_trunk"] = (f"{side}_hip", f"{side}_shoulder", TRUNK_RADIUS)
    names = list(parts)
    return Capsules(
        ends=np.array([[JOINT_INDEX[a], JOINT_INDEX[b]] for a, b, _ in parts.values()], np.int64),
        radius=np.array([radius for _, _, radius in parts.values()]),
        hides=np.array([[name not in _own_parts(joint) for name in names] for joint in JOINTS]),
    )


def _own_parts(joint: str) -> set[str]:
    """Capsules that a joint lies in."""
    trunk = {"left_trunk", "right_trunk", "spine"}
    side, _, name = joint.partition("_")
    if not name:
        return {"head", "spine"} if joint == "head" else {"head", *trunk}
    limbs = {
        "shoulder": (*trunk, f"{side}_upper_arm"),
        "elbow": (f"{side}_upper_arm", f"{side}_forearm"),
        "hand": (f"{side}_forearm",),
        "hip": (*trunk, f"{side}_thigh"),
        "knee": (f"{side}_thigh", f"{side}_shank"),
        "foot": (f"{side}_shank",),
    }
    return set(limbs[name])


@compiled_into_caller
def fill_occlusion(
    capsules: Capsules, joints: FloatArray, camera: FloatArray, out: FloatArray
) -> None:
    """Compute the degree of occlusion of each joint.

    Args:
        capsules: The body's parts.
        joints: Predicted positions in map, (joints, 3) [m].
        camera: Position of the camera in map, (3,) [m].
        out: Filled, (joints,): 0 (visible) to 1 (hidden).
    """
    sight, axis = np.empty(3), np.empty(3)
    for joint in range(len(joints)):
        for k in range(3):
            sight[k] = joints[joint, k] - camera[k]
        shorter = 1.0 - STAND_OFF / np.sqrt(dot(sight, sight))
        for k in range(3):
            sight[k] *= shorter
        out[joint] = 0.0
        for part in range(len(capsules.radius)):
            if not capsules.hides[joint, part]:
                continue
            start, end = joints[capsules.ends[part, 0]], joints[capsules.ends[part, 1]]
            for k in range(3):
                axis[k] = end[k] - start[k]
            gap = segment_distance(camera, sight, start, axis)
            depth = (capsules.radius[part] - gap) / SOFTNESS
            if depth > -CUTOFF_WIDTHS:
                out[joint] = max(out[joint], 1.0 / (1.0 + np.exp(-depth)))


@compiled_in_place
def segment_distance(p: FloatArray, u: FloatArray, q: FloatArray, v: FloatArray) -> float:
    """Distance [m] between the line segments p + s u and q + t v, s and t in [0, 1].

    References:
        Ericson (2005), Real-Time Collision Detection, 5.1.9.
    """
    x, y, z = p[0] - q[0], p[1] - q[1], p[2] - q[2]
    uu, vv, uv = dot(u, u), dot(v, v) + 1e-9, dot(u, v)
    uw, vw = u[0] * x + u[1] * y + u[2] * z, v[0] * x + v[1] * y + v[2] * z
    s = min(max((uv * vw - uw * vv) / max(uu * vv - uv * uv, 1e-12), 0.0), 1.0)
    t = min(max((uv * s + vw) / vv, 0.0), 1.0)
    s = min(max((uv * t - uw) / uu, 0.0), 1.0)
    x, y, z = x + s * u[0] - t * v[0], y + s * u[1] - t * v[1], z + s * u[2] - t * v[2]
    return np.sqrt(x * x + y * y + z * z)
