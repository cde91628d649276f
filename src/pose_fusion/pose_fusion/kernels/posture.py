"""The soft measurements of :mod:`pose_fusion.filters.posture`, each of two links' relative turn."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pose_fusion.kernels.compiling import compiled
from pose_fusion.kernels.links import flexion, twist
from pose_fusion.kernels.rotations import logarithm, transposed_product
from pose_fusion.streams.samples import FloatArray

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
    relative, turn, axis = np.empty((3, 3)), np.empty(3), np.empty(3)
    for index in range(len(numbers.hinge_links)):
        parent, link = numbers.hinge_parents[index], numbers.hinge_links[index]
        add_hinge(numbers, index, rotations[parent], rotations[link], information, vector)
    for index in range(len(numbers.twist_links)):
        parent, link = numbers.twist_parents[index], numbers.twist_links[index]
        transposed_product(rotations[parent], rotations[link], relative)
        angle, defined = twist(relative)
        variance = numbers.twist_variance[index] / max(defined, LEAST_DEFINED) ** 2
        axis[:] = rotations[link, :, 2]
        add_look(parent, link, axis, -angle, variance, information, vector)
    for index in range(len(numbers.spine_links)):
        parent, link = numbers.spine_parents[index], numbers.spine_links[index]
        transposed_product(rotations[parent], rotations[link], relative)
        logarithm(relative, turn)
        for k in range(3):
            axis[:] = rotations[parent, :, k]
            variance = numbers.spine_variance[k]
            add_look(parent, link, axis, -turn[k], variance, information, vector)


@compiled
def add_hinge(
    numbers: PostureNumbers,
    index: int,
    R_parent: FloatArray,
    R_link: FloatArray,
    information: FloatArray,
    vector: FloatArray,
) -> None:
    """A hinge keeps its link's lateral axis u along its parent's, and bends one way only.

    u's part p · u along the parent's x and z axes is to be zero; its derivative by a small turn of
    the link in map is u × p.
    """
    parent, link = numbers.hinge_parents[index], numbers.hinge_links[index]
    axis, relative = np.empty(3), np.empty((3, 3))
    x, y, z = R_link[0, 1], R_link[1, 1], R_link[2, 1]
    for k in (0, 2):
        px, py, pz = R_parent[0, k], R_parent[1, k], R_parent[2, k]
        axis[0], axis[1], axis[2] = y * pz - z * py, z * px - x * pz, x * py - y * px
        lateral = px * x + py * y + pz * z
        add_look(parent, link, axis, -lateral, numbers.hinge_variance, information, vector)
    transposed_product(R_parent, R_link, relative)
    angle = flexion(relative, numbers.hinge_signs[index])
    if angle < 0.0:
        axis[:] = numbers.hinge_signs[index] * R_parent[:, 1]
        add_look(parent, link, axis, -angle, numbers.limit_variance, information, vector)


@compiled
def add_look(
    parent: int,
    link: int,
    axis: FloatArray,
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
