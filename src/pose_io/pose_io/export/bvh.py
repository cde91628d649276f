r"""BVH: the person's tree with its bones [cm], for Blender and other animation programs.

Axes as is usual there: x to the person's left, y up, z forward, :math:`p_{bvh} = (y, z, x)` of a
point in ``map``; at rest the person stands in the neutral pose, facing z. A joint's rotation
channels are its joint angles, in the order in which the body model applies them: nothing is
decomposed, so nothing can flip.
"""

import numpy as np
from scipy.spatial.transform import Rotation

from pose_core.api import ROOT_DOF, BodyModel, Dof, Link, unwrapped
from pose_core.arrays import FloatArray
from pose_core.errors import InputError
from pose_core.finite_numbers import plain_numbers
from pose_core.joints import JOINT_INDEX, JOINTS
from pose_io.export.exporter import Exporter
from pose_io.export.motion import BodyMotion

R_bvh_map = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
CM = 100.0  # [cm/m]
ROOT = "hips"  # midway between the hip joints
ROOT_ORDER = "YXZ"  # heading first
AXES = "XYZ"


def bvh_text(motion: BodyMotion, rate: float) -> str:
    """The motion, at the constant rate [Hz]."""
    root = next(iter(motion.model.links.values()))
    lines = ["HIERARCHY", *_joint(motion.model, motion.offsets @ R_bvh_map.T * CM, root, 0)]
    lines += ["MOTION", f"Frames: {len(motion)}", f"Frame Time: {1.0 / rate:.8f}"]
    for row in _channels(motion):
        lines.append(" ".join(f"{value:.5f}" for value in row))
    return "\n".join(lines) + "\n"


def _joint(model: BodyModel, offsets_cm: FloatArray, link: Link, depth: int) -> list[str]:
    """Lines of a link and its descendants, in the order of :func:`_channels`."""
    indent, inner = "\t" * depth, "\t" * (depth + 1)
    is_root = link.joint is None
    offset = np.zeros(3) if link.joint is None else offsets_cm[JOINT_INDEX[link.joint]]
    turns = " ".join(f"{axis}rotation" for axis in (ROOT_ORDER if is_root else _order(link)))
    channels = f"6 Xposition Yposition Zposition {turns}" if is_root else f"3 {turns}"
    lines = [
        f"{indent}{'ROOT' if is_root else 'JOINT'} {ROOT if is_root else link.joint}",
        f"{indent}{{",
        f"{inner}OFFSET {plain_numbers(offset)}",
        f"{inner}CHANNELS {channels}",
    ]
    children = _children(model, link)
    for child in children:
        lines += _joint(model, offsets_cm, child, depth + 1)
    if not children:
        end = next(joint for joint in JOINTS if model.joints[joint].link == link.name)
        lines += [f"{inner}End Site", f"{inner}{{"]
        lines += [f"{inner}\tOFFSET {plain_numbers(offsets_cm[JOINT_INDEX[end]])}", f"{inner}}}"]
    return [*lines, f"{indent}}}"]


def _channels(motion: BodyMotion) -> FloatArray:
    """Root position [cm], then each link's angles [deg], depth first; shape (n, channels)."""
    model = motion.model
    root = next(iter(model.links.values()))
    R_map_body = Rotation.from_rotvec(motion.dof[:, 3:ROOT_DOF]).as_matrix()
    angles = Rotation.from_matrix(R_bvh_map @ R_map_body @ R_bvh_map.T).as_euler(ROOT_ORDER)
    columns = [motion.dof[:, :3] @ R_bvh_map.T * CM]
    columns.append(np.degrees(np.stack([unwrapped(angle) for angle in angles.T], axis=1)))
    for link in _depth_first(model, root)[1:]:
        turns = np.zeros((len(motion), len(AXES)))
        for column, dof in enumerate(link.dof):
            sign = _axis(dof)[1]
            turns[:, column] = sign * np.degrees(motion.dof[:, model.dof_index[dof.name]])
        columns.append(turns)
    return np.concatenate(columns, axis=1)


def _order(link: Link) -> str:
    """The rotation axes of a link in their order, then the remaining axes."""
    used = "".join(_axis(dof)[0] for dof in link.dof)
    return used + "".join(axis for axis in AXES if axis not in used)


def _axis(dof: Dof) -> tuple[str, float]:
    """BVH's axis of a degree of freedom, and its sign."""
    axis = R_bvh_map @ np.array(dof.axis)
    index = int(np.argmax(np.abs(axis)))
    if abs(axis[index]) != np.abs(axis).sum():
        raise InputError(f"BVH turns about x, y or z: {dof.name} turns about {dof.axis}")
    return AXES[index], float(np.sign(axis[index]))


def _children(model: BodyModel, link: Link) -> list[Link]:
    return [child for child in model.links.values() if child.parent == link.name]


def _depth_first(model: BodyModel, link: Link) -> list[Link]:
    return [link, *(below for c in _children(model, link) for below in _depth_first(model, c))]


BVH = Exporter(
    doc="the moving skeleton, for Blender",
    content=lambda motion, options: bvh_text(motion, options.rate).encode(),
    fills_gaps=True,
    unknown_angles="they are interpolated",
    rigid_bones=True,
)
