r"""Where a body's joints are, how fast they move, and how they depend on the pose's error.

.. math:: p_j = p_\mathrm{root} + \sum_l R_l\,(o_{jl} + s_{jl})

A joint depends on few links: those between it and the root. ``columns`` lists them, as blocks of
three columns of the pose's error: block 0 is the root's position, block 1 + l link l's rotation,
the last ones are the slides.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pose_core.kernels.compiling import compiled_in_place
from pose_core.streams.samples import FloatArray


class BodyNumbers(NamedTuple):
    """A body's tree as arrays."""

    offsets: FloatArray  # (joints, links, 3) [m] in the links' axes
    sliding_links: NDArray[np.int64]  # (slides,): the link that each slides in
    slides: FloatArray  # (joints, slides): 1 where a joint goes along
    columns: NDArray[np.int64]  # (joints, most): blocks of the error that each depends on
    column_count: NDArray[np.int64]  # (joints,)


class Pose(NamedTuple):
    """A segment filter's state, all but the covariance; see ``SegmentState``."""

    position: FloatArray
    rotations: FloatArray
    slides: FloatArray
    velocity: FloatArray
    rates: FloatArray


@compiled_in_place
def place_joints(
    body: BodyNumbers,
    position: FloatArray,
    rotations: FloatArray,
    slides: FloatArray,
    levers: FloatArray,
    joints: FloatArray,
) -> None:
    """Fill ``levers``, (joints, links, 3), what each link adds, and ``joints``, (joints, 3) [m]."""
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
def joint_velocities(
    body: BodyNumbers, levers: FloatArray, velocity: FloatArray, rates: FloatArray, out: FloatArray
) -> None:
    """Velocities [m/s] of the joints, (joints, 3): the root's, and ω × lever of every link."""
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
def derivative(
    body: BodyNumbers,
    joint: int,
    levers: FloatArray,
    rotations: FloatArray,
    share: float,
    out: FloatArray,
) -> None:
    """One joint's derivative: I, −[lever]ₓ and the slides' axes, in the columns that it depends on.

    Args:
        body: The tree.
        joint: Which.
        levers: See :func:`place_joints`.
        rotations: ``R_map_link``, (links, 3, 3).
        share: Factor [-] of all but the root's position.
        out: The derivative, (3, size): only those columns are filled.
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
