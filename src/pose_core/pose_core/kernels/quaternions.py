"""Quaternions (x, y, z, w) as scalars: products, integration of an angular rate."""

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.kernels.compiling import compiled_in_place
from pose_core.kernels.rotations import SMALL_ANGLE

Quaternion = tuple[float, float, float, float]


@compiled_in_place
def quaternion_product(p: Quaternion, q: Quaternion) -> Quaternion:
    """Product of two quaternions."""
    return (
        p[3] * q[0] + p[0] * q[3] + p[1] * q[2] - p[2] * q[1],
        p[3] * q[1] - p[0] * q[2] + p[1] * q[3] + p[2] * q[0],
        p[3] * q[2] + p[0] * q[1] - p[1] * q[0] + p[2] * q[3],
        p[3] * q[3] - p[0] * q[0] - p[1] * q[1] - p[2] * q[2],
    )


@compiled_in_place
def integrated_orientation(
    before: FloatArray, rate_before: FloatArray, rate: FloatArray, dt_s: float
) -> Quaternion:
    """An orientation, (4,), turned on by the mean of two rates, (3,) [rad/s]."""
    x = 0.5 * dt_s * (rate_before[0] + rate[0])
    y = 0.5 * dt_s * (rate_before[1] + rate[1])
    z = 0.5 * dt_s * (rate_before[2] + rate[2])
    angle = np.sqrt(x * x + y * y + z * z)
    part = 0.5 if angle < SMALL_ANGLE else np.sin(0.5 * angle) / angle
    turn = (part * x, part * y, part * z, np.cos(0.5 * angle))
    return quaternion_product((before[0], before[1], before[2], before[3]), turn)
