"""A person's kinematic tree as URDF, with measured bone lengths.

One revolute joint for each joint angle, named like it, so that RViz, MoveIt and other readers can
follow the ``joint_states``. The link at the end of a chain of joints is called ``<link>_<id>``,
links inside the chain are named after their joint angle, the root is ``body_<id>``. Joints at the
ends of limbs, such as the hands, are empty links ``<joint>_joint_<id>``.
"""

from xml.etree import ElementTree

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.body.model import BodyModel, Link
from pose_core.body.shape import BodyShape
from pose_core.finite_numbers import plain_numbers
from pose_core.joints import JOINT_INDEX, JOINTS

THICKNESS = 0.14  # [-] a limb's radius over its length
THINNEST, THICKEST = 0.03, 0.07  # [m] radius of a limb
HEAD_RADIUS = 0.10  # [m]
NECK_RADIUS = 0.05  # [m]
PELVIS_HEIGHT = 0.2  # [m]
DEPTH = 0.5  # [-] the trunk's depth over its width
HALF_HIP_WIDTH = 0.08  # [m] from the hip joint to the side of the pelvis
SHORTEST = 0.04  # [m] shorter parts are not drawn
COLORS = {  # suitable for colour-blind people, as those of the markers
    "left": (0.34, 0.71, 0.91),
    "right": (0.90, 0.62, 0.0),
    "middle": (0.75, 0.75, 0.75),
}


MAX_EFFORT = 1000.0  # [N m] required by URDF
MAX_RATE = 50.0  # [rad/s] likewise


def add_visuals(
    element: ElementTree.Element, model: BodyModel, shape: BodyShape, link: Link
) -> None:
    """Add a link's solids: boxes of pelvis and chest, the head's ball, the limbs' cylinders."""
    fixed = [joint for joint in JOINTS if model.joints[joint].link == link.name]
    place = {joint: shape.offsets[JOINT_INDEX[joint]] for joint in fixed}
    side = link.name.split("_")[0]
    color = side if side in COLORS else "middle"
    if "left_hip" in place:
        left, right = place["left_hip"], place["right_hip"]
        width = float(np.linalg.norm(left - right)) + 2.0 * HALF_HIP_WIDTH
        size = np.array([DEPTH * width, width, PELVIS_HEIGHT])
        _add(element, "box", 0.5 * (left + right) + [0.0, 0.0, 0.04], "middle", size=size)
    if "left_shoulder" in place:
        left, right = place["left_shoulder"], place["right_shoulder"]
        top = 0.5 * (left + right)
        width, height = float(np.linalg.norm(left - right)), float(top[2])
        size = np.array([DEPTH * width, width, height])
        _add(element, "box", np.array([0.5 * top[0], 0.0, 0.5 * height]), "middle", size=size)
        for shoulder, own_color in ((left, "left"), (right, "right")):
            _add(element, "sphere", shoulder, own_color, radius=THICKEST)
        if "neck" in place:
            _add(element, "sphere", place["neck"], "middle", radius=NECK_RADIUS)
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
    x, y, z = (0.0, 0.0, 1.0) if direction is None else direction
    rpy = np.array([0.0, np.arctan2(np.hypot(x, y), z), np.arctan2(y, x)])  # turn z into it
    ElementTree.SubElement(visual, "origin", xyz=plain_numbers(centre), rpy=plain_numbers(rpy))
    geometry = ElementTree.SubElement(visual, "geometry")
    texts = {name: plain_numbers(np.atleast_1d(value)) for name, value in sizes.items()}
    ElementTree.SubElement(geometry, solid, texts)
    material = ElementTree.SubElement(visual, "material", name=f"body_{color}")
    ElementTree.SubElement(material, "color", rgba=plain_numbers(np.array([*COLORS[color], 1.0])))


def link_frame(link: Link, body_id: str) -> str:
    """The frame of a link."""
    return f"body_{body_id}" if link.parent is None else f"{link.name}_{body_id}"


def chain_frames(link: Link, body_id: str) -> list[str]:
    """The frames after each of a link's degrees of freedom, in order; the last is the link's."""
    return [*(f"{dof.name}_{body_id}" for dof in link.dof[:-1]), link_frame(link, body_id)]


def end_joints(model: BodyModel) -> list[str]:
    """The joints about which no link rotates."""
    turning = {link.joint for link in model.links.values()}
    return [joint for joint in JOINTS if joint not in turning]


def joint_frame(model: BodyModel, joint: str, body_id: str) -> str:
    """The frame whose origin is one of the 15 joints."""
    for link in model.links.values():
        if link.joint == joint:
            return link_frame(link, body_id)
    return f"{joint}_joint_{body_id}"


def make_urdf(model: BodyModel, shape: BodyShape, body_id: str) -> str:
    """The person's tree as an URDF document."""
    robot = ElementTree.Element("robot", name=f"human_{body_id}")
    limits = dict(zip(model.angle_names, model.limits, strict=True))
    for link in model.links.values():
        if link.parent is None or link.joint is None:
            root = ElementTree.SubElement(robot, "link", name=link_frame(link, body_id))
            add_visuals(root, model, shape, link)
            continue
        parent = link_frame(model.links[link.parent], body_id)
        origin = shape.offsets[JOINT_INDEX[link.joint]]
        for dof, child in zip(link.dof, chain_frames(link, body_id), strict=True):
            element = ElementTree.SubElement(robot, "link", name=child)
            if dof is link.dof[-1]:
                add_visuals(element, model, shape, link)
            joint = _add_joint(robot, dof.name, "revolute", parent, child, origin)
            ElementTree.SubElement(joint, "axis", xyz=plain_numbers(np.array(dof.axis)))
            lower, upper = limits[dof.name]
            ElementTree.SubElement(
                joint,
                "limit",
                lower=repr(float(lower)),  # exact, since published angles reach it
                upper=repr(float(upper)),
                effort=f"{MAX_EFFORT:g}",
                velocity=f"{MAX_RATE:g}",
            )
            parent, origin = child, np.zeros(3)
    for end in end_joints(model):
        child = joint_frame(model, end, body_id)
        parent = link_frame(model.links[model.joints[end].link], body_id)
        ElementTree.SubElement(robot, "link", name=child)
        _add_joint(robot, child, "fixed", parent, child, shape.offsets[JOINT_INDEX[end]])
    ElementTree.indent(robot)
    return '<?xml version="1.0"?>\n' + ElementTree.tostring(robot, encoding="unicode") + "\n"


def _add_joint(
    robot: ElementTree.Element, name: str, kind: str, parent: str, child: str, origin: FloatArray
) -> ElementTree.Element:
    joint = ElementTree.SubElement(robot, "joint", name=name, type=kind)
    ElementTree.SubElement(joint, "parent", link=parent)
    ElementTree.SubElement(joint, "child", link=child)
    ElementTree.SubElement(joint, "origin", xyz=plain_numbers(origin), rpy="0 0 0")
    return joint
