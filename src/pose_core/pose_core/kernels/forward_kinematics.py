r"""Forward kinematics from degrees of freedom, one state after the other: h of li2020 (11).

.. math:: R_\mathrm{link} = R_\mathrm{parent} \prod_d \exp([a_d]_\times q_d)
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pose_core.arrays import FloatArray
from pose_core.kernels.compiling import compiled_in_place, compiled_into_caller
from pose_core.kernels.rotations import rotate_left, rotate_right

ROOT_DOF = 6  # position [m], then rotation vector [rad]


class ModelArrays(NamedTuple):
    """A body model as arrays; parents come before children."""

    parents: NDArray[np.int64]  # (links,), −1 of the root
    dof_count: NDArray[np.int64]  # (links,) degrees of freedom
    dof: NDArray[np.int64]  # (links, 3): their place in the state
    axes: FloatArray  # (links, 3, 3): of each, in the link's axes
    limits: FloatArray  # (links, 3, 2) [rad]: of each, lower and upper
    pivot_joints: NDArray[np.int64]  # (links,): the joint, −1 of the root
    link_of_joint: NDArray[np.int64]  # (joints,): the link that each joint is fixed in
    offsets: FloatArray  # (joints, 3) [m]: in that link's axes


@compiled_in_place
def compute_links(
    model: ModelArrays,
    R_reference: FloatArray,
    dof: FloatArray,
    rotations: FloatArray,
    positions: FloatArray,
) -> None:
    """Compute ``R_map_link``, (n, links, 3, 3), and joints [m], (n, joints, 3), of n states."""
    for index in range(len(dof)):
        compute_pose(model, R_reference, dof[index], rotations[index], positions[index])


@compiled_in_place
def compute_pose(
    model: ModelArrays,
    R_reference: FloatArray,
    state: FloatArray,
    rotations: FloatArray,
    positions: FloatArray,
) -> None:
    """Compute ``R_map_link``, (links, 3, 3), and joints [m], (joints, 3), of one state."""
    for link in range(len(model.parents)):
        compute_link_rotation(model, link, R_reference, state, rotations)
        compute_fixed_joints(model, link, state, rotations[link], positions)


@compiled_into_caller
def compute_link_rotation(
    model: ModelArrays, link: int, R_reference: FloatArray, state: FloatArray, rotations: FloatArray
) -> None:
    """Compute one link's ``R_map_link``, given its parent's."""
    parent = model.parents[link]
    R, R_before = rotations[link], R_reference if parent < 0 else rotations[parent]
    for i in range(3):
        for k in range(3):
            R[i, k] = R_before[i, k]
    if parent < 0:
        rotate_left(state[3], state[4], state[5], R)
    for k in range(model.dof_count[link]):
        angle, axis = state[model.dof[link, k]], model.axes[link, k]
        rotate_right(angle * axis[0], angle * axis[1], angle * axis[2], R)


@compiled_into_caller
def compute_fixed_joints(
    model: ModelArrays, link: int, state: FloatArray, R: FloatArray, positions: FloatArray
) -> None:
    """Compute the joints fixed in a link, given the position of the joint it rotates about."""
    about = model.pivot_joints[link]
    origin = state[:3] if about < 0 else positions[about]
    for joint in range(len(model.offsets)):
        if model.link_of_joint[joint] == link:
            o = model.offsets[joint]
            for axis in range(3):
                positions[joint, axis] = (
                    origin[axis] + R[axis, 0] * o[0] + R[axis, 1] * o[1] + R[axis, 2] * o[2]
                )
