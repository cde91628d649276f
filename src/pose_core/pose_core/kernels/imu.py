"""An IMU's orientation at an instant, and what it says of its segment."""

import numpy as np

from pose_core.kernels.compiling import compiled_in_place
from pose_core.kernels.rotations import (
    matrix_of_quaternion,
    product_transposed,
    turn_by,
    turn_within,
    vector_scale,
)
from pose_core.streams.samples import FloatArray


@compiled_in_place
def interpolate(first: FloatArray, second: FloatArray, share: float, out: FloatArray) -> None:
    """The rotation matrix between two orientations (x, y, z, w), along the shortest way.

    Args:
        first: At share 0.
        second: At share 1.
        share: How far in between [-].
        out: (3, 3).
    """
    # conj(first) second, of the product of their lengths
    x, y, z, w = -first[0], -first[1], -first[2], first[3]
    a = w * second[0] + x * second[3] + y * second[2] - z * second[1]
    b = w * second[1] - x * second[2] + y * second[3] + z * second[0]
    c = w * second[2] + x * second[1] - y * second[0] + z * second[3]
    d = w * second[3] - x * second[0] - y * second[1] - z * second[2]
    length = np.sqrt(a * a + b * b + c * c + d * d)
    scale = share * vector_scale(a / length, b / length, c / length, d / length) / length
    turn_on(first, scale * a, scale * b, scale * c, out)


@compiled_in_place
def turn_on(orientation: FloatArray, x: float, y: float, z: float, out: FloatArray) -> None:
    """The rotation matrix of an orientation (x, y, z, w) turned on by a vector [rad] of its own."""
    matrix_of_quaternion(orientation, out)
    turn_within(x, y, z, out)


@compiled_in_place
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
    product_transposed(R_world_sensor, R_world_sensor_neutral, R_map_segment)
    turn_by(0.0, 0.0, heading, R_map_segment)
    turn_within(0.0, 0.0, neutral_turn, R_map_segment)
    R, w = R_world_sensor, angular_velocity
    x = R[0, 0] * w[0] + R[0, 1] * w[1] + R[0, 2] * w[2]
    y = R[1, 0] * w[0] + R[1, 1] * w[1] + R[1, 2] * w[2]
    c, s = np.cos(heading), np.sin(heading)
    rate_map[0], rate_map[1] = c * x - s * y, s * x + c * y
    rate_map[2] = R[2, 0] * w[0] + R[2, 1] * w[1] + R[2, 2] * w[2]
