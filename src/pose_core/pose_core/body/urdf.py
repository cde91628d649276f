"""A person's kinematic tree as URDF, with measured bone lengths.

One revolute joint for each joint angle, named like it, so that RViz, MoveIt and other readers can
follow the ``joint_states``. The link that a chain of joints ends in is called ``<link>_<id>``,
those inside the chain after their joint angle, the root ``body_<id>``. Joints about which nothing
turns, such as the hands, are empty links ``<joint>_joint_<id>``.
"""

from xml.etree import ElementTree

import numpy as np

from pose_core.body.model import BodyModel, Link
from pose_core.body.plain_numbers import plain_numbers
from pose_core.body.shape import BodyShape
from pose_core.body.urdf_visuals import add_visuals
from pose_core.joints import JOINT_INDEX, JOINTS
from pose_core.streams.samples import FloatArray

LARGEST_EFFORT = 1000.0  # [N m] URDF wants a number
LARGEST_RATE = 50.0  # [rad/s] likewise


def link_frame(link: Link, body_id: str) -> str:
    """The frame of a link."""
    return f"body_{body_id}" if link.parent is None else f"{link.name}_{body_id}"


def chain_frames(link: Link, body_id: str) -> list[str]:
    """The frames after each of a link's degrees of freedom, in turn; the last is the link's."""
    return [*(f"{dof.name}_{body_id}" for dof in link.dof[:-1]), link_frame(link, body_id)]


def end_joints(model: BodyModel) -> list[str]:
    """The joints about which no link turns."""
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
            _add_link(robot, link_frame(link, body_id), model, shape, link)
            continue
        parent = link_frame(model.links[link.parent], body_id)
        origin = shape.offsets[JOINT_INDEX[link.joint]]
        for dof, child in zip(link.dof, chain_frames(link, body_id), strict=True):
            is_last = dof is link.dof[-1]
            _add_link(robot, child, model, shape, link if is_last else None)
            joint = _add_joint(robot, dof.name, "revolute", parent, child, origin)
            ElementTree.SubElement(joint, "axis", xyz=plain_numbers(np.array(dof.axis)))
            lower, upper = limits[dof.name]
            ElementTree.SubElement(
                joint,
                "limit",
                lower=repr(float(lower)),  # exact: angles that are published keep to it
                upper=repr(float(upper)),
                effort=f"{LARGEST_EFFORT:g}",
                velocity=f"{LARGEST_RATE:g}",
            )
            parent, origin = child, np.zeros(3)
    for end in end_joints(model):
        child = joint_frame(model, end, body_id)
        parent = link_frame(model.links[model.joints[end].link], body_id)
        _add_link(robot, child, model, shape, None)
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


def _add_link(
    robot: ElementTree.Element, frame: str, model: BodyModel, shape: BodyShape, link: Link | None
) -> None:
    """Add a link, with its shapes if it is a body part."""
    element = ElementTree.SubElement(robot, "link", name=frame)
    if link is not None:
        add_visuals(element, model, shape, link)
