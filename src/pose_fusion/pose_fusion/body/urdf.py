"""A person's kinematic tree as URDF, with measured bone lengths.

One revolute joint for each joint angle, named like it, so that ``robot_state_publisher`` and RViz
can follow the ``joint_states``. The link that a chain of joints ends in is called
``<link>_<id>``; the root is ``body_<id>``.
"""

from xml.etree import ElementTree

import numpy as np

from pose_common.joints import JOINT_INDEX
from pose_fusion.body.model import BodyModel, Link
from pose_fusion.body.shape import BodyShape
from pose_fusion.streams.samples import FloatArray

BONE_RADIUS = 0.04  # [m] of the drawn capsules
LARGEST_EFFORT = 1000.0  # [N m] URDF wants a number
LARGEST_RATE = 50.0  # [rad/s] likewise


def link_frame(link: Link, body_id: str) -> str:
    """The frame of a link."""
    return f"body_{body_id}" if link.parent is None else f"{link.name}_{body_id}"


def make_urdf(model: BodyModel, shape: BodyShape, body_id: str) -> str:
    """The person's tree as an URDF document."""
    robot = ElementTree.Element("robot", name=f"human_{body_id}")
    limits = dict(zip(model.angle_names, model.limits, strict=True))
    for link in model.links.values():
        frame = link_frame(link, body_id)
        if link.parent is None or link.joint is None:
            _add_link(robot, frame, model, shape, link)
            continue
        parent = link_frame(model.links[link.parent], body_id)
        origin = shape.offsets[JOINT_INDEX[link.joint]]
        for index, dof in enumerate(link.dof):
            is_last = index == len(link.dof) - 1
            child = frame if is_last else f"{dof.name}_{body_id}"
            _add_link(robot, child, model, shape, link if is_last else None)
            joint = ElementTree.SubElement(robot, "joint", name=dof.name, type="revolute")
            ElementTree.SubElement(joint, "parent", link=parent)
            ElementTree.SubElement(joint, "child", link=child)
            ElementTree.SubElement(joint, "origin", xyz=_numbers(origin), rpy="0 0 0")
            ElementTree.SubElement(joint, "axis", xyz=_numbers(np.array(dof.axis)))
            lower, upper = limits[dof.name]
            ElementTree.SubElement(
                joint,
                "limit",
                lower=f"{lower:.5f}",
                upper=f"{upper:.5f}",
                effort=f"{LARGEST_EFFORT:g}",
                velocity=f"{LARGEST_RATE:g}",
            )
            parent, origin = child, np.zeros(3)
    ElementTree.indent(robot)
    return '<?xml version="1.0"?>\n' + ElementTree.tostring(robot, encoding="unicode") + "\n"


def _add_link(
    robot: ElementTree.Element, frame: str, model: BodyModel, shape: BodyShape, link: Link | None
) -> None:
    """Add a link; with a bone to each joint that is fixed in it, if it is a body part."""
    element = ElementTree.SubElement(robot, "link", name=frame)
    if link is None:
        return
    for joint, place in model.joints.items():
        offset = shape.offsets[JOINT_INDEX[joint]]
        length = float(np.linalg.norm(offset))
        if place.link != link.name or length < BONE_RADIUS:
            continue
        visual = ElementTree.SubElement(element, "visual")
        ElementTree.SubElement(
            visual, "origin", xyz=_numbers(offset / 2.0), rpy=_numbers(_rpy_of_z_axis(offset))
        )
        geometry = ElementTree.SubElement(visual, "geometry")
        ElementTree.SubElement(
            geometry, "cylinder", radius=f"{BONE_RADIUS:g}", length=f"{length:.5f}"
        )


def _rpy_of_z_axis(direction: FloatArray) -> FloatArray:
    """Fixed-axis roll, pitch, yaw [rad] that turn z into a direction."""
    x, y, z = direction
    return np.array([0.0, float(np.arctan2(np.hypot(x, y), z)), float(np.arctan2(y, x))])


def _numbers(values: FloatArray) -> str:
    return " ".join(f"{float(value) + 0.0:.5f}" for value in values)
