r"""Posture prior: soft constraints on the relative rotation of two links.

- The lateral axis u of a hinge is parallel to its parent's: :math:`p_x \cdot u = p_z \cdot u = 0`,
  with p the parent's axes; the derivative by a rotation of the link is :math:`u \times p`.
- Axial rotation (twist) of limbs and head is limited. The waist bends sideways and rotates little,
  and bends forward more.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pose_core.arrays import FloatArray
from pose_core.filter.layout import rotation_column
from pose_core.filter.rows import NORMAL, Rows, add_group
from pose_core.filter.state import FilterState
from pose_core.kernels.axial_rotation import Hinges
from pose_core.kernels.compiling import compiled, compiled_in_place, compiled_into_caller
from pose_core.kernels.rotations import logarithm, transposed_product
from pose_core.kernels.swing_twist import flexion, twist

MIN_DEFINED = 1e-3  # [-] lower bound of how well a twist is defined
HINGE_DOF = 3.0  # [-] of Student's t of hinges: a wrong prior yields to the cameras
OPPOSITE = -0.5  # [-] cosine between a hinge's lateral axes, below which one link is turned back
NO_SOURCE = -1


class PostureConstants(NamedTuple):
    """Indices of the constrained links and the variance of each constraint."""

    hinges: Hinges
    hinge_variance: float  # [rad²]
    wrong_bend: float  # [rad], negative
    twist_parents: NDArray[np.int64]
    twist_links: NDArray[np.int64]
    twist_variance: FloatArray  # [rad²]
    spine_parents: NDArray[np.int64]
    spine_links: NDArray[np.int64]
    spine_variance: FloatArray  # (3,) [rad²] about the parent's axes


@compiled_in_place
def most_posture_rows(constants: PostureConstants) -> int:
    """Upper bound of the number of rows that :func:`add_posture_rows` adds."""
    spine = 3 * len(constants.spine_links)
    return 2 * len(constants.hinges.links) + len(constants.twist_links) + spine


@compiled_into_caller
def add_posture_rows(constants: PostureConstants, rotations: FloatArray, rows: Rows) -> None:
    """Add the rows of the prior, for rotations ``R_map_link``, (links, 3, 3)."""
    relative, turn = np.empty((3, 3)), np.empty(3)
    for hinge in range(len(constants.hinges.links)):
        add_hinge(constants, hinge, rotations, rows)
    for index in range(len(constants.twist_links)):
        parent, link = constants.twist_parents[index], constants.twist_links[index]
        R = rotations[link]
        transposed_product(rotations[parent], R, relative)
        angle, defined = twist(relative)
        variance = constants.twist_variance[index] / max(defined, MIN_DEFINED) ** 2
        add_relative_rotation(
            rows, parent, link, (R[0, 2], R[1, 2], R[2, 2]), -angle, variance, NORMAL
        )
    for index in range(len(constants.spine_links)):
        parent, link = constants.spine_parents[index], constants.spine_links[index]
        R = rotations[parent]
        transposed_product(R, rotations[link], relative)
        logarithm(relative, turn)
        for k in range(3):
            axis = (R[0, k], R[1, k], R[2, k])
            add_relative_rotation(
                rows, parent, link, axis, -turn[k], constants.spine_variance[k], NORMAL
            )


@compiled_into_caller
def add_hinge(constants: PostureConstants, hinge: int, rotations: FloatArray, rows: Rows) -> None:
    """Add the two rows of a hinge's plane."""
    parent, link = constants.hinges.parents[hinge], constants.hinges.links[hinge]
    R_parent, R_link = rotations[parent], rotations[link]
    x, y, z = R_link[0, 1], R_link[1, 1], R_link[2, 1]
    for k in (0, 2):
        px, py, pz = R_parent[0, k], R_parent[1, k], R_parent[2, k]
        axis = (y * pz - z * py, z * px - x * pz, x * py - y * px)
        residual = -(px * x + py * y + pz * z)
        add_relative_rotation(
            rows, parent, link, axis, residual, constants.hinge_variance, HINGE_DOF
        )


@compiled
def add_relative_rotation(
    rows: Rows,
    parent: int,
    link: int,
    axis: tuple[float, float, float],
    residual: float,
    variance: float,
    student_dof: float,
) -> None:
    """Add one row: the rotation of a link relative to its parent about an axis in map."""
    group = add_group(rows, 1, student_dof, NO_SOURCE)
    row = rows.first[group]
    for k in range(3):
        rows.H[row, rotation_column(link) + k] = axis[k]
        rows.H[row, rotation_column(parent) + k] = -axis[k]
    rows.residual[row] = residual
    rows.noise[group, 0, 0] = variance


@compiled_in_place
def undo_half_turns(constants: PostureConstants, state: FilterState, relative: FloatArray) -> int:
    """Rotate limbs that are half a turn off about their long axes; returns their number.

    A hinge whose lateral axes are opposite satisfies :func:`add_hinge`, too: its lower link is
    rotated, or the upper one if the lower has an IMU. Of a hinge that bends backwards too far, both
    links are rotated. No joint moves. Links with an IMU are not changed: it measures their axial
    rotation. ``relative`` is a work array, (3, 3).
    """
    count = 0
    for hinge in range(len(constants.hinges.links)):
        parent, link = constants.hinges.parents[hinge], constants.hinges.links[hinge]
        if state.imus.is_used[parent] and state.imus.is_used[link]:
            continue
        upper, lower = state.pose.rotations[parent], state.pose.rotations[link]
        transposed_product(upper, lower, relative)
        if relative[1, 1] < OPPOSITE:
            turn_half(upper if state.imus.is_used[link] else lower)
            count += 1
            transposed_product(upper, lower, relative)
        if state.imus.is_used[parent] or state.imus.is_used[link]:
            continue
        if flexion(relative, constants.hinges.signs[hinge]) < constants.wrong_bend:
            turn_half(upper)
            turn_half(lower)
            count += 1
    return count


@compiled_in_place
def turn_half(R: FloatArray) -> None:
    """Rotate a link, in place, by half a turn about its own z axis."""
    for i in range(3):
        for k in range(2):
            R[i, k] = -R[i, k]
