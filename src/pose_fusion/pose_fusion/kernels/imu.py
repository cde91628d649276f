"""An IMU's orientation at an instant, and what it says of its segment."""

import numpy as np

from pose_fusion.kernels.compiling import compiled
from pose_fusion.kernels.rotations import (
    exponential,
    matrix_of_quaternion,
    product,
    product_transposed,
    vector_of_quaternion,
)
from pose_fusion.streams.samples import FloatArray


@compiled
def interpolate(first: FloatArray, second: FloatArray, share: float, out: FloatArray) -> None:
    """The rotation matrix between two orientations (x, y, z, w), along the shortest way.

    Args:
        first: At share 0.
        second: At share 1.
        share: How far in between [-].
        out: (3, 3).
    """
    relative, turn = np.empty(4), np.empty(3)
    # conj(first) second, of the product of their lengths
    x, y, z, w = -first[0], -first[1], -first[2], first[3]
    relative[0] = w * second[0] + x * second[3] + y * second[2] - z * second[1]
    relative[1] = w * second[1] - x * second[2] + y * second[3] + z * second[0]
    relative[2] = w * second[2] + x * second[1] - y * second[0] + z * second[3]
    relative[3] = w * second[3] - x * second[0] - y * second[1] - z * second[2]
    relative /= np.sqrt((relative**2).sum())
    vector_of_quaternion(relative, turn)
    turn_on(first, share * turn, out)


@compiled
def turn_on(orientation: FloatArray, turn: FloatArray, out: FloatArray) -> None:
    """The rotation matrix of an orientation (x, y, z, w) turned on by a vector [rad] of its own."""
    R, step = np.empty((3, 3)), np.empty((3, 3))
    matrix_of_quaternion(orientation, R)
    exponential(turn[0], turn[1], turn[2], step)
    product(R, step, out)


@compiled
def about_up(angle: float, out: FloatArray) -> None:
    """The rotation matrix of a turn [rad] about z."""
    c, s = np.cos(angle), np.sin(angle)
    out[:] = 0.0
    out[0, 0], out[0, 1], out[1, 0], out[1, 1], out[2, 2] = c, -s, s, c, 1.0


@compiled
def read_segment(
    R_world_sensor: FloatArray,
    R_world_sensor_neutral: FloatArray,
    angular_velocity: FloatArray,
    heading: float,
    neutral_turn: float,
    R_map_segment: FloatArray,
    rate_map: FloatArray,
) -> None:
    """Fill Y R_ws R_ws(0)ᵀ R_z(ψ − y₀), and the angular velocity in map; see ``imu.alignment``."""
    Y, Z = np.empty((3, 3)), np.empty((3, 3))
    first, second = np.empty((3, 3)), np.empty((3, 3))
    about_up(heading, Y)
    about_up(neutral_turn, Z)
    product_transposed(R_world_sensor, R_world_sensor_neutral, first)
    product(Y, first, second)
    product(second, Z, R_map_segment)
    product(Y, R_world_sensor, first)
    for i in range(3):
        rate_map[i] = 0.0
        for k in range(3):
            rate_map[i] += first[i, k] * angular_velocity[k]
