"""Link frames: transforms of the links and of the frames between and beyond them."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pose_core.arrays import FloatArray
from pose_core.kernels.compiling import compiled, compiled_in_place, compiled_into_caller
from pose_core.kernels.rotations import exponential, product, quaternion, transposed_product


class AuxiliaryFrames(NamedTuple):
    """Frames other than links: rotated back about one axis of a joint, or at the end of a limb."""

    source: NDArray[np.int64]  # (n,) row of the frame it derives from: a link, or an earlier row
    dof: NDArray[np.int64]  # (n,) degree of freedom that is rotated back; −1 for an end
    axis: FloatArray  # (n, 3) of that degree of freedom
    joint: NDArray[np.int64]  # (n,) joint at an end


@compiled_in_place
def compute_link_transforms(
    position: FloatArray,
    rotations: FloatArray,
    joints: FloatArray,
    pivot_joints: NDArray[np.int64],
    T_map_link: FloatArray,
) -> None:
    """Compute the links' transforms: the origin is the joint that a link rotates about.

    Args:
        position: Of the root [m], (3,).
        rotations: ``R_map_link``, (links, 3, 3).
        joints: In map, (15, 3) [m].
        pivot_joints: The joint of each link, (links,); −1 of the root.
        T_map_link: Filled, (links, 4, 4).
    """
    for link in range(len(rotations)):
        T, joint = T_map_link[link], pivot_joints[link]
        for i in range(3):
            for k in range(3):
                T[i, k] = rotations[link, i, k]
            T[i, 3] = position[i] if joint < 0 else joints[joint, i]
            T[3, i] = 0.0
        T[3, 3] = 1.0


@compiled_into_caller
def compute_frame_poses(
    T_map_link: FloatArray,
    angles: FloatArray,
    joints: FloatArray,
    between: AuxiliaryFrames,
    places: FloatArray,
) -> None:
    """Compute frames as positions and quaternions: the first in map, all others in the first.

    Args:
        T_map_link: Shape (links, 4, 4).
        angles: Degrees of freedom [rad], shape (d,).
        joints: In map, shape (15, 3) [m].
        between: The frames other than links.
        places: Filled, shape (links + n, 7): x, y, z [m]; quaternion x, y, z, w.
    """
    links = len(T_map_link)
    R, p = np.empty((len(places), 3, 3)), np.empty((len(places), 3))
    for row in range(links):
        R[row] = T_map_link[row, :3, :3]
        p[row] = T_map_link[row, :3, 3]
    turn = np.empty((3, 3))
    for index in range(len(between.source)):
        row, source = links + index, between.source[index]
        if between.dof[index] < 0:
            R[row], p[row] = R[source], joints[between.joint[index]]
            continue
        x, y, z = -angles[between.dof[index]] * between.axis[index]
        exponential(x, y, z, turn)
        product(R[source], turn, R[row])
        p[row] = p[source]
    R_body_frame = np.empty((3, 3))
    for row in range(len(places)):
        if row == 0:
            quaternion(R[0], places[0, 3:])
            places[0, :3] = p[0]
            continue
        for i in range(3):
            places[row, i] = 0.0
            for k in range(3):
                places[row, i] += R[0, k, i] * (p[row, k] - p[0, k])
        transposed_product(R[0], R[row], R_body_frame)
        quaternion(R_body_frame, places[row, 3:])


@compiled
def compute_frame_poses_batch(
    T_map_link: FloatArray,
    angles: FloatArray,
    joints: FloatArray,
    between: AuxiliaryFrames,
    places: FloatArray,
) -> None:
    """Compute the frames at n instants; see :func:`compute_frame_poses`."""
    for row in range(len(places)):
        compute_frame_poses(T_map_link[row], angles[row], joints[row], between, places[row])
