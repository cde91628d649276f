r"""Forward kinematics of a body model, for many states at once.

A link's rotation is :math:`R_\mathrm{link} = R_\mathrm{parent} \prod_d \exp([a_d]_\times q_d)`
over its degrees of freedom, the root's :math:`\exp([v]_\times)\,R_\mathrm{ref}` with rotation
vector v; a joint fixed in a link at offset o lies at
:math:`p = p_\mathrm{link} + R_\mathrm{link}\,o`. This is h of li2020 (11).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pose_core.body.model import ROOT_DOF, BodyModel
from pose_core.joints import JOINT_INDEX, JOINTS
from pose_core.kernels import joint_angle_extraction
from pose_core.kernels.forward_kinematics import ModelArrays, compute_links
from pose_core.streams.samples import FloatArray

SMALL_ANGLE = 1e-6  # [rad] below it, the series of the left Jacobian


def skew(vector: FloatArray) -> FloatArray:
    """Cross-product matrices, shape (..., 3) to (..., 3, 3)."""
    matrix = np.zeros((*vector.shape, 3))
    matrix[..., 0, 1], matrix[..., 0, 2] = -vector[..., 2], vector[..., 1]
    matrix[..., 1, 0], matrix[..., 1, 2] = vector[..., 2], -vector[..., 0]
    matrix[..., 2, 0], matrix[..., 2, 1] = -vector[..., 1], vector[..., 0]
    return matrix


def left_jacobian(vector: FloatArray) -> FloatArray:
    """J with exp(v + δ) ≈ exp(J δ) exp(v), for one rotation vector v [rad]; shape (3, 3)."""
    angle = float(np.linalg.norm(vector))
    if angle < SMALL_ANGLE:
        return np.eye(3) + 0.5 * skew(vector)
    cross = skew(vector)
    return (
        np.eye(3)
        + (1.0 - np.cos(angle)) / angle**2 * cross
        + (angle - np.sin(angle)) / angle**3 * (cross @ cross)
    )


def moved_axes(R_map_parent: FloatArray, axes: FloatArray, angles: FloatArray) -> FloatArray:
    """A joint's axes in map, each moved by the preceding rotations.

    Args:
        R_map_parent: Shape (3, 3).
        axes: In the link's own axes, shape (k, 3).
        angles: Angles of the k rotations [rad].

    Returns:
        Shape (k, 3).
    """
    moved = np.empty((len(axes), 3))
    joint_angle_extraction.moved_axes(
        np.ascontiguousarray(R_map_parent), np.array(axes, float), np.array(angles, float), moved
    )
    return moved


@dataclass(frozen=True, kw_only=True)
class BodyPose:
    """Link rotations and joint positions, for one state or many."""

    rotations: FloatArray  # (..., links, 3, 3): R_map_link
    positions: FloatArray  # (..., 15, 3) [m] the joints in map


class ForwardKinematics:
    """Joint positions and link rotations of one body.

    Args:
        model: The tree.
        offsets: Position of each joint in its link's axes, shape (15, 3) [m].
        R_reference: Rotation of the root's zero rotation vector, ``R_map_body``.
    """

    def __init__(
        self, model: BodyModel, offsets: FloatArray, R_reference: FloatArray | None = None
    ) -> None:
        self.model = model
        self.offsets = offsets
        self.R_reference = np.eye(3) if R_reference is None else R_reference
        self._link_index = {name: index for index, name in enumerate(model.link_names)}
        axes = {dof.name: dof.axis for link in model.links.values() for dof in link.dof}
        self._axes = np.array([axes[name] for name in model.angle_names], dtype=float)
        self._angle_index = {name: index for index, name in enumerate(model.angle_names)}
        self._numbers = model_arrays(model, offsets)

    def pose(self, dof: FloatArray) -> BodyPose:
        """Compute all links and joints.

        Args:
            dof: Root position [m], root rotation vector [rad], joint angles [rad]; shape (..., d).
        """
        lead, links = dof.shape[:-1], len(self.model.links)
        rotations, positions = np.empty((*lead, links, 3, 3)), np.empty((*lead, len(JOINTS), 3))
        compute_links(
            self._numbers,
            np.ascontiguousarray(self.R_reference),
            np.ascontiguousarray(dof).reshape(-1, dof.shape[-1]),
            rotations.reshape(-1, links, 3, 3),
            positions.reshape(-1, len(JOINTS), 3),
        )
        return BodyPose(rotations=rotations, positions=positions)

    def jacobian(self, dof: FloatArray) -> FloatArray:
        """Jacobian of the joint positions with respect to the degrees of freedom, at one state.

        Args:
            dof: One state's degrees of freedom, shape (d,).

        Returns:
            Shape (15, 3, d), in [m] per [m] or [rad].
        """
        pose = self.pose(dof)
        jacobian = np.zeros((len(JOINTS), 3, self.model.size))
        jacobian[:, :, :3] = np.eye(3)
        arms = pose.positions - dof[:3]
        jacobian[:, :, 3:6] = -skew(arms) @ left_jacobian(dof[3:6])
        for link in self.model.links.values():
            if link.parent is None or link.joint is None:
                continue
            below = self._joints_below[link.name]
            arms = pose.positions[below] - pose.positions[JOINT_INDEX[link.joint]]
            parent = pose.rotations[self._link_index[link.parent]]
            angles = [self._angle_index[degree.name] for degree in link.dof]
            axes = moved_axes(parent, self._axes[angles], dof[ROOT_DOF:][angles])
            for angle, axis in zip(angles, axes, strict=True):
                jacobian[below, :, ROOT_DOF + angle] = np.cross(axis, arms)
        return jacobian

    @property
    def _joints_below(self) -> dict[str, NDArray[np.int_]]:
        """The joints that a rotation of a link moves."""
        below: dict[str, list[int]] = {name: [] for name in self.model.links}
        for joint in JOINTS:
            name: str | None = self.model.joints[joint].link
            while name is not None:
                below[name].append(JOINT_INDEX[joint])
                name = self.model.links[name].parent
        return {name: np.array(joints, int) for name, joints in below.items()}


def model_arrays(model: BodyModel, offsets: FloatArray) -> ModelArrays:
    """Convert a body model and its joints' offsets, (15, 3) [m], to the kernels' arrays."""
    links = list(model.links.values())
    index = {link.name: number for number, link in enumerate(links)}
    dof, axes = np.full((len(links), 3), -1, np.int64), np.zeros((len(links), 3, 3))
    limits = np.zeros((len(links), 3, 2))
    for row, link in enumerate(links):
        for column, degree in enumerate(link.dof):
            dof[row, column], axes[row, column] = model.dof_index[degree.name], degree.axis
            limits[row, column] = degree.lower, degree.upper
    parents = [-1 if link.parent is None else index[link.parent] for link in links]
    about = [-1 if link.joint is None else JOINT_INDEX[link.joint] for link in links]
    return ModelArrays(
        parents=np.array(parents, np.int64),
        dof_count=np.array([len(link.dof) for link in links], np.int64),
        dof=dof,
        axes=axes,
        limits=limits,
        turns_about=np.array(about, np.int64),
        link_of_joint=np.array([index[model.joints[j].link] for j in JOINTS], np.int64),
        offsets=np.array(offsets, float, order="C"),
    )
