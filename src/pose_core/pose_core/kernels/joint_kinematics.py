r"""Joint positions and velocities from link rotations, and the linear part of their Jacobian.

.. math:: p_j = p_\mathrm{root} + \sum_l R_l\,(o_{jl} + s_{jl})

A joint is carried by few links, those between it and the root: ``carriers`` lists them.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pose_core.arrays import FloatArray
from pose_core.kernels.compiling import compiled_in_place


class BodyArrays(NamedTuple):
    """A body's tree as arrays."""

    parents: NDArray[np.int64]  # (links,): −1 of the root
    offsets: FloatArray  # (joints, links, 3) [m] in the links' axes
    sliding_links: NDArray[np.int64]  # (slides,): the link that each slides in
    slides: FloatArray  # (joints, slides): 1 if a joint moves with a sliding joint
    carriers: NDArray[np.int64]  # (joints, most): the links that carry each
    carrier_count: NDArray[np.int64]  # (joints,)


@compiled_in_place
def compute_joints(
    body: BodyArrays,
    position: FloatArray,
    rotations: FloatArray,
    slides: FloatArray,
    levers: FloatArray,
    joints: FloatArray,
) -> None:
    """Compute joint positions and lever arms, in map.

    Args:
        body: The tree.
        position: Of the root, (3,) [m].
        rotations: ``R_map_link``, (links, 3, 3).
        slides: Of the sliding joints in their links' axes, (slides, 3) [m].
        levers: Filled, (joints, links, 3) [m]: lever arm of each link to each joint.
        joints: Filled, (joints, 3) [m].
    """
    for j in range(len(levers)):
        for axis in range(3):
            joints[j, axis] = position[axis]
        for c in range(body.carrier_count[j]):
            link = body.carriers[j, c]
            R, offset = rotations[link], body.offsets[j, link]
            for axis in range(3):
                levers[j, link, axis] = (
                    R[axis, 0] * offset[0] + R[axis, 1] * offset[1] + R[axis, 2] * offset[2]
                )
        for column in range(len(body.sliding_links)):
            if body.slides[j, column] != 0.0:
                link = body.sliding_links[column]
                R, slide = rotations[link], slides[column]
                for axis in range(3):
                    levers[j, link, axis] += body.slides[j, column] * (
                        R[axis, 0] * slide[0] + R[axis, 1] * slide[1] + R[axis, 2] * slide[2]
                    )
        for c in range(body.carrier_count[j]):
            for axis in range(3):
                joints[j, axis] += levers[j, body.carriers[j, c], axis]


@compiled_in_place
def compute_joint_velocities(
    body: BodyArrays, levers: FloatArray, velocity: FloatArray, rates: FloatArray, out: FloatArray
) -> None:
    """Compute joint velocities [m/s], (joints, 3): the root's plus ω × lever of every link."""
    for j in range(len(levers)):
        for axis in range(3):
            out[j, axis] = velocity[axis]
        for c in range(body.carrier_count[j]):
            link = body.carriers[j, c]
            w, r = rates[link], levers[j, link]
            out[j, 0] += w[1] * r[2] - w[2] * r[1]
            out[j, 1] += w[2] * r[0] - w[0] * r[2]
            out[j, 2] += w[0] * r[1] - w[1] * r[0]


@compiled_in_place
def joint_jacobian(
    body: BodyArrays, joint: int, rotations: FloatArray, first_slide: int, out: FloatArray
) -> None:
    """Fill a joint's Jacobian with respect to the root's position and the slides, (3, size).

    Args:
        body: The tree.
        joint: Index of the joint.
        rotations: ``R_map_link``, (links, 3, 3).
        first_slide: First column of the slides.
        out: Only the columns that the joint depends on are filled.
    """
    out[0, 0] = out[1, 1] = out[2, 2] = 1.0
    for column in range(len(body.sliding_links)):
        share = body.slides[joint, column]
        if share != 0.0:
            R = rotations[body.sliding_links[column]]
            for i in range(3):
                for k in range(3):
                    out[i, first_slide + 3 * column + k] = share * R[i, k]
