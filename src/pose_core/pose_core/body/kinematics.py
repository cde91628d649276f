r"""Forward kinematics of a body model, for many states at once.

A link's rotation is :math:`R_\mathrm{link} = R_\mathrm{parent} \prod_d \exp([a_d]_\times q_d)`
over its degrees of freedom, the root's :math:`\exp([v]_\times)\,R_\mathrm{ref}` with rotation
vector v; a joint fixed in a link at offset o lies at
:math:`p = p_\mathrm{link} + R_\mathrm{link}\,o`. This is h of li2020 (11).
"""

from dataclasses import dataclass

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.body.model import BodyModel
from pose_core.joints import JOINTS
from pose_core.kernels.forward_kinematics import ModelArrays, compute_links

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
        self.R_reference = np.eye(3) if R_reference is None else R_reference
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


def model_arrays(model: BodyModel, offsets: FloatArray) -> ModelArrays:
    """Convert a body model and its joints' offsets, (15, 3) [m], to the kernels' arrays."""
    links = list(model.links.values())
    dof, axes = np.full((len(links), 3), -1, np.int64), np.zeros((len(links), 3, 3))
    limits = np.zeros((len(links), 3, 2))
    for row, link in enumerate(links):
        for column, degree in enumerate(link.dof):
            dof[row, column], axes[row, column] = model.dof_index[degree.name], degree.axis
            limits[row, column] = degree.lower, degree.upper
    return ModelArrays(
        parents=model.parents,
        dof_count=np.array([len(link.dof) for link in links], np.int64),
        dof=dof,
        axes=axes,
        limits=limits,
        pivot_joints=model.link_joints,
        link_of_joint=np.array([model.link_index[model.joints[j].link] for j in JOINTS]),
        offsets=np.array(offsets, float, order="C"),
    )
