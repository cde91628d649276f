"""What the cameras see of each segment's axes: the long one, z, and the lateral one, y.

The trunk's lateral axis is the shoulders' line, the pelvis' that of the hips. A limb has one where
its knee or elbow is bent: the hinge. A forearm has none, for it turns about itself below the elbow.
"""

import math
from collections.abc import Iterable

import numpy as np

from pose_common.joints import JOINT_INDEX
from pose_fusion.body.model import BodyModel
from pose_fusion.body.trunk import cross
from pose_fusion.streams.samples import FloatArray

SHORTEST_BONE = 0.01  # [m] joints nearer to each other than that give no direction
LEAST_BEND = math.sin(math.radians(30.0))  # [-] of a hinge whose axis is believed
HINGE_SHARPNESS = 0.5  # [-] of a hinge's axis at a right angle, against a long axis
LINES = {"pelvis": ("right_hip", "left_hip"), "torso": ("right_shoulder", "left_shoulder")}

Seen = tuple[FloatArray, float]
"""An axis in map as the cameras see it, shape (3,), and how sharply [-], 1 like a long axis."""


def long_axes(
    model: BodyModel, segments: Iterable[str], positions: FloatArray, trunk: FloatArray
) -> dict[str, FloatArray]:
    """The z axis in map of each segment whose joints are tracked.

    Args:
        model: The body model.
        segments: Names of segments that IMUs are worn on.
        positions: Joints in map, shape (15, 3) [m]; NaN where not tracked.
        trunk: The trunk's axes in map, shape (3, 3).
    """
    axes = {}
    for segment in segments:
        name = model.segments.get(segment)
        axis = None if name is None else _long_axis(model, name, positions, trunk)
        if axis is not None:
            axes[segment] = axis
    return axes


def lateral_axes(
    model: BodyModel, segments: Iterable[str], positions: FloatArray
) -> dict[str, Seen]:
    """The y axis in map of each segment where it can be seen.

    Args:
        model: The body model.
        segments: Names of segments that IMUs are worn on.
        positions: Joints in map, shape (15, 3) [m]; NaN where not tracked.
    """
    seen: dict[str, Seen] = {}
    worn = set(segments)
    for segment, (start, end) in LINES.items():
        line = positions[JOINT_INDEX[end]] - positions[JOINT_INDEX[start]]
        length = math.sqrt(line @ line)
        if segment in worn and length > SHORTEST_BONE:  # false of NaN
            seen[segment] = line / length, 1.0
    of_link = {link: segment for segment, link in model.segments.items()}
    for link in model.links.values():
        if len(link.dof) != 1 or link.parent is None:
            continue
        upper, lower = of_link.get(link.parent, ""), of_link.get(link.name, "")
        hinge = _hinge(model, (link.parent, link.name), positions)
        if hinge is None:
            continue
        for segment in {upper, lower} & worn:
            if "forearm" not in segment:
                seen[segment] = hinge
    return seen


def _long_axis(
    model: BodyModel, name: str, positions: FloatArray, trunk: FloatArray | None
) -> FloatArray | None:
    start, end = model.ends(name)
    direction = model.joints[end].direction
    if direction is None:
        return None if trunk is None else trunk[:, 2]
    bone = positions[JOINT_INDEX[end]] - positions[JOINT_INDEX[start]]
    length = math.sqrt(bone @ bone)
    if not length > SHORTEST_BONE:  # true of NaN
        return None
    return np.asarray(bone * (direction[2] / length))


def _hinge(model: BodyModel, links: tuple[str, str], positions: FloatArray) -> Seen | None:
    """The hinge between two links as their y axis; None while it is nearly straight."""
    first, second = (_long_axis(model, name, positions, None) for name in links)
    if first is None or second is None:
        return None
    normal = cross(first, second) * model.links[links[1]].dof[0].axis[1]
    sine = math.sqrt(normal @ normal)
    if not sine > LEAST_BEND:
        return None
    return normal / sine, HINGE_SHARPNESS * sine
