"""The soft measurements of :mod:`pose_core.filters.posture`, each of two links' relative turn."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pose_core.kernels.compiling import compiled, compiled_in_place
from pose_core.kernels.links import flexion, twist
from pose_core.kernels.rotations import logarithm, transposed_product
from pose_core.streams.samples import FloatArray

LEAST_DEFINED = 1e-3  # [-] of a twist


class PostureNumbers(NamedTuple):
    """Which links, and how surely."""

    hinge_parents: NDArray[np.int64]
    hinge_links: NDArray[np.int64]
    hinge_signs: FloatArray
    hinge_variance: float  # [rad²] out of their plane
    limit_variance: float  # [rad²] bent the wrong way
    twist_parents: NDArray[np.int64]
    twist_links: NDArray[np.int64]
    twist_variance: FloatArray  # [rad²]
    spine_parents: NDArray[np.int64]
    spine_links: NDArray[np.int64]
    spine_variance: FloatArray  # (3,) [rad²] about the parent's axes


@compiled
def add_posture(
    numbers: PostureNumbers, rotations: FloatArray, information: FloatArray, vector: FloatArray
) -> None:
    """Add all that is known beforehand of a pose, given its ``R_map_link``, (links, 3, 3)."""
    relative, turn = np.empty((3, 3)), np.empty(3)
    for index in range(len(numbers.hinge_links)):
        add_hinge(numbers, index, rotations, relative, information, vector)
    for index in range(len(numbers.twist_links)):
        add_twist(numbers, index, rotations, relative, information, vector)
    for index in range(len(numbers.spine_links)):
        add_spine(numbers, index, rotations, relative, turn, information, vector)


@compiled_in_place
def add_hinge(
    numbers: PostureNumbers,
    index: int,
    rotations: FloatArray,
    relative: FloatArray,
    information: FloatArray,
    vector: FloatArray,
) -> None:
    """A hinge keeps its link's lateral axis u along its parent's, and bends one way only.

    u's part p · u along the parent's x and z axes is to be zero; its derivative by a small turn of
    the link in map is u × p. ``relative`` is room for a matrix.
    """
    parent, link = numbers.hinge_parents[index], numbers.hinge_links[index]
    R_parent, R_link = rotations[parent], rotations[link]
    x, y, z = R_link[0, 1], R_link[1, 1], R_link[2, 1]
    for k in (0, 2):
        px, py, pz = R_parent[0, k], R_parent[1, k], R_parent[2, k]
        axis = (y * pz - z * py, z * px - x * pz, x * py - y * px)
        lateral = px * x + py * y + pz * z
        add_look(parent, link, axis, -lateral, numbers.hinge_variance, information, vector)
    transposed_product(R_parent, R_link, relative)
    sign = numbers.hinge_signs[index]
    angle = flexion(relative, sign)
    if angle < 0.0:
        axis = (sign * R_parent[0, 1], sign * R_parent[1, 1], sign * R_parent[2, 1])
        add_look(parent, link, axis, -angle, numbers.limit_variance, information, vector)


@compiled_in_place
def add_twist(
    numbers: PostureNumbers,
    index: int,
    rotations: FloatArray,
    relative: FloatArray,
    information: FloatArray,
    vector: FloatArray,
) -> None:
    """A limb is turned little about itself, which the less defined is the further it swings."""
    parent, link = numbers.twist_parents[index], numbers.twist_links[index]
    R = rotations[link]
    transposed_product(rotations[parent], R, relative)
    angle, defined = twist(relative)
    variance = numbers.twist_variance[index] / max(defined, LEAST_DEFINED) ** 2
    add_look(parent, link, (R[0, 2], R[1, 2], R[2, 2]), -angle, variance, information, vector)


@compiled_in_place
def add_spine(
    numbers: PostureNumbers,
    index: int,
    rotations: FloatArray,
    relative: FloatArray,
    turn: FloatArray,
    information: FloatArray,
    vector: FloatArray,
) -> None:
    """The trunk's parts are turned little against each other, about each of the lower's axes."""
    parent, link = numbers.spine_parents[index], numbers.spine_links[index]
    R = rotations[parent]
    transposed_product(R, rotations[link], relative)
    logarithm(relative, turn)
    for k in range(3):
        axis, variance = (R[0, k], R[1, k], R[2, k]), numbers.spine_variance[k]
        add_look(parent, link, axis, -turn[k], variance, information, vector)


@compiled_in_place
def add_look(
    parent: int,
    link: int,
    axis: tuple[float, float, float],
    residual: float,
    variance: float,
    information: FloatArray,
    vector: FloatArray,
) -> None:
    """Add one scalar measurement of a link's turn relative to its parent's: four (3, 3) blocks."""
    first, second = 3 + 3 * parent, 3 + 3 * link
    for i in range(3):
        vector[second + i] += axis[i] * residual / variance
        vector[first + i] -= axis[i] * residual / variance
        for k in range(3):
            weight = axis[i] * axis[k] / variance
            information[second + i, second + k] += weight
            information[first + i, first + k] += weight
            information[second + i, first + k] -= weight
            information[first + i, second + k] -= weight
