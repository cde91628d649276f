"""What a link of the URDF looks like: simple solids, sized by the measured bones."""

from xml.etree import ElementTree

import numpy as np

from pose_core.body.model import BodyModel, Link
from pose_core.body.plain_numbers import plain_numbers
from pose_core.body.shape import BodyShape
from pose_core.joints import JOINT_INDEX, JOINTS
from pose_core.streams.samples import FloatArray

THICKNESS = 0.14  # [-] a limb's radius over its length
THINNEST, THICKEST = 0.03, 0.07  # [m] radius of a limb
HEAD_RADIUS = 0.10  # [m]
NECK_RADIUS = 0.05  # [m]
PELVIS_HEIGHT = 0.2  # [m]
DEPTH = 0.5  # [-] the trunk's depth over its width
HALF_HIP_WIDTH = 0.08  # [m] from the hip joint to the side of the pelvis
SHORTEST = 0.04  # [m] nothing is drawn of what is shorter
COLORS = {  # safe for colour-blind eyes, as those of the markers
    "left": (0.34, 0.71, 0.91),
    "right": (0.90, 0.62, 0.0),
    "middle": (0.75, 0.75, 0.75),
}


def add_visuals(
    element: ElementTree.Element, model: BodyModel, shape: BodyShape, link: Link
) -> None:
    """Add a link's solids: boxes of pelvis and chest, the head's ball, the limbs' cylinders."""
    fixed = [joint for joint in JOINTS if model.joints[joint].link == link.name]
    place = {joint: shape.offsets[JOINT_INDEX[joint]] for joint in fixed}
    side = link.name.split("_")[0]
    color = side if side in COLORS else "middle"
    if "left_hip" in place:
        _add_pelvis(element, place["left_hip"], place["right_hip"])
    if "left_shoulder" in place:
        _add_chest(element, place["left_shoulder"], place["right_shoulder"], place.get("neck"))
    if "left_hip" in place or "left_shoulder" in place:
        return
    for joint, offset in place.items():
        length = float(np.linalg.norm(offset))
        if length < SHORTEST:
            continue
        radius = float(np.clip(THICKNESS * length, THINNEST, THICKEST))
        _add(element, "cylinder", offset / 2.0, color, offset, radius=radius, length=length)
        _add(element, "sphere", np.zeros(3), color, radius=radius)
        _add(element, "sphere", offset, color, radius=HEAD_RADIUS if joint == "head" else radius)


def _add_pelvis(element: ElementTree.Element, left: FloatArray, right: FloatArray) -> None:
    width = float(np.linalg.norm(left - right)) + 2.0 * HALF_HIP_WIDTH
    size = np.array([DEPTH * width, width, PELVIS_HEIGHT])
    _add(element, "box", 0.5 * (left + right) + [0.0, 0.0, 0.04], "middle", size=size)


def _add_chest(
    element: ElementTree.Element, left: FloatArray, right: FloatArray, neck: FloatArray | None
) -> None:
    """A box from the link's origin up to the shoulders, and a neck."""
    top = 0.5 * (left + right)
    width, height = float(np.linalg.norm(left - right)), float(top[2])
    size = np.array([DEPTH * width, width, height])
    _add(element, "box", np.array([0.5 * top[0], 0.0, 0.5 * height]), "middle", size=size)
    for shoulder, color in ((left, "left"), (right, "right")):
        _add(element, "sphere", shoulder, color, radius=THICKEST)
    if neck is not None:
        _add(element, "sphere", neck, "middle", radius=NECK_RADIUS)


def _add(
    element: ElementTree.Element,
    solid: str,
    centre: FloatArray,
    color: str,
    direction: FloatArray | None = None,
    **sizes: float | FloatArray,
) -> None:
    """Add a solid, its z axis along the direction."""
    visual = ElementTree.SubElement(element, "visual")
    rpy = np.zeros(3) if direction is None else _rpy_of_z_axis(direction)
    ElementTree.SubElement(visual, "origin", xyz=plain_numbers(centre), rpy=plain_numbers(rpy))
    geometry = ElementTree.SubElement(visual, "geometry")
    texts = {name: plain_numbers(np.atleast_1d(value)) for name, value in sizes.items()}
    ElementTree.SubElement(geometry, solid, texts)
    material = ElementTree.SubElement(visual, "material", name=f"body_{color}")
    ElementTree.SubElement(material, "color", rgba=plain_numbers(np.array([*COLORS[color], 1.0])))


def _rpy_of_z_axis(direction: FloatArray) -> FloatArray:
    """Fixed-axis roll, pitch, yaw [rad] that turn z into a direction."""
    x, y, z = direction
    return np.array([0.0, float(np.arctan2(np.hypot(x, y), z)), float(np.arctan2(y, x))])
