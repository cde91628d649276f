r"""Joint positions and velocities from link rotations, and their Jacobian by the pose's error.

.. math:: p_j = p_\mathrm{root} + \sum_l R_l\,(o_{jl} + s_{jl})

A joint depends on few links: those between it and the root. ``columns`` lists them, as blocks of
three columns of the error state: block 0 is the root's position, block 1 + l link l's rotation,
the last ones are the slides.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pose_core.kernels.compiling import compiled_in_place
from pose_core.streams.samples import FloatArray


class BodyArrays(NamedTuple):
    """A body's tree as arrays."""

    offsets: FloatArray  # (joints, links, 3) [m] in the links' axes
    sliding_links: NDArray[np.int64]  # (slides,): the link that each slides in
    slides: FloatArray  # (joints, slides): 1 where a joint goes along
    columns: NDArray[np.int64]  # (joints, most): blocks of the error that each depends on
    column_count: NDArray[np.int64]  # (joints,)


class Pose(NamedTuple):
    """Mean of the state, links as rotations; see :class:`pose_core.filter.state.FilterState`."""

    position: FloatArray
    rotations: FloatArray
    slides: FloatArray
    velocity: FloatArray
    rates: FloatArray


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
        levers: Filled, (joints, links, 3) [m]: what each link adds to each joint.
        joints: Filled, (joints, 3) [m].
    """
    count, links = levers.shape[0], levers.shape[1]
    for j in range(count):
        for axis in range(3):
            joints[j, axis] = position[axis]
        for c in range(body.column_count[j]):
            link = body.columns[j, c] - 1
            if not 0 <= link < links:
                continue
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
        for c in range(body.column_count[j]):
            link = body.columns[j, c] - 1
            if 0 <= link < links:
                for axis in range(3):
                    joints[j, axis] += levers[j, link, axis]


@compiled_in_place
def compute_joint_velocities(
    body: BodyArrays, levers: FloatArray, velocity: FloatArray, rates: FloatArray, out: FloatArray
) -> None:
    """Compute joint velocities [m/s], (joints, 3): the root's plus ω × lever of every link."""
    links = levers.shape[1]
    for j in range(levers.shape[0]):
        for axis in range(3):
            out[j, axis] = velocity[axis]
        for c in range(body.column_count[j]):
            link = body.columns[j, c] - 1
            if 0 <= link < links:
                w, r = rates[link], levers[j, link]
                out[j, 0] += w[1] * r[2] - w[2] * r[1]
                out[j, 1] += w[2] * r[0] - w[0] * r[2]
                out[j, 2] += w[0] * r[1] - w[1] * r[0]


@compiled_in_place
def joint_jacobian(
    body: BodyArrays,
    joint: int,
    levers: FloatArray,
    rotations: FloatArray,
    share: float,
    out: FloatArray,
) -> None:
    """Compute one joint's Jacobian: I, −[lever]ₓ and the slides' axes, where not zero.

    Args:
        body: The tree.
        joint: Which.
        levers: See :func:`compute_joints`.
        rotations: ``R_map_link``, (links, 3, 3).
        share: Factor [-] of all columns but the root's position.
        out: The Jacobian, (3, size): only the columns that the joint depends on are filled.
    """
    links = levers.shape[1]
    for c in range(body.column_count[joint]):
        block = body.columns[joint, c]
        at = 3 * block
        if block == 0:
            out[0, at] = out[1, at + 1] = out[2, at + 2] = 1.0
        elif block <= links:
            x, y, z = levers[joint, block - 1]
            out[0, at + 1], out[1, at] = share * z, -share * z
            out[0, at + 2], out[2, at] = -share * y, share * y
            out[1, at + 2], out[2, at + 1] = share * x, -share * x
        else:
            column = block - 1 - links
            goes_along = share * body.slides[joint, column]
            R = rotations[body.sliding_links[column]]
            for i in range(3):
                for k in range(3):
                    out[i, at + k] = goes_along * R[i, k]
