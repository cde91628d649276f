r"""Rotations one at a time: matrices, rotation vectors, quaternions.

.. math:: \exp([v]_\times) = I + \frac{\sin\theta}{\theta} [v]_\times
          + \frac{1 - \cos\theta}{\theta^2} [v]_\times^2, \quad \theta = |v|
"""

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.kernels.compiling import compiled_in_place, compiled_into_caller

SMALL_ANGLE = 1e-6  # [rad] below it, series replace sin x / x and (1 - cos x) / x²


@compiled_in_place
def rodrigues(squared: float) -> tuple[float, float]:
    """Factors of Rodrigues' formula, sin θ / θ and (1 − cos θ) / θ², for θ² [rad²]."""
    angle = np.sqrt(squared)
    if angle < SMALL_ANGLE:
        return 1.0 - squared / 6.0, 0.5 - squared / 24.0
    return np.sin(angle) / angle, (1.0 - np.cos(angle)) / squared


@compiled_in_place
def exponential(x: float, y: float, z: float, out: FloatArray) -> None:
    """The rotation matrix of a rotation vector [rad]."""
    first, second = rodrigues(x * x + y * y + z * z)
    out[0, 0] = 1.0 - second * (y * y + z * z)
    out[1, 1] = 1.0 - second * (x * x + z * z)
    out[2, 2] = 1.0 - second * (x * x + y * y)
    out[0, 1], out[1, 0] = second * x * y - first * z, second * x * y + first * z
    out[0, 2], out[2, 0] = second * x * z + first * y, second * x * z - first * y
    out[1, 2], out[2, 1] = second * y * z - first * x, second * y * z + first * x


@compiled_in_place
def rotate_left(x: float, y: float, z: float, R: FloatArray) -> None:
    """Replace R by exp(v) R, for a rotation vector v [rad]."""
    first, second = rodrigues(x * x + y * y + z * z)
    for k in range(3):
        a, b, c = R[0, k], R[1, k], R[2, k]
        u, v, w = y * c - z * b, z * a - x * c, x * b - y * a
        R[0, k] = a + first * u + second * (y * w - z * v)
        R[1, k] = b + first * v + second * (z * u - x * w)
        R[2, k] = c + first * w + second * (x * v - y * u)


@compiled_in_place
def rotate_right(x: float, y: float, z: float, R: FloatArray) -> None:
    """Replace R by R exp(v), for a rotation vector v [rad]."""
    first, second = rodrigues(x * x + y * y + z * z)
    for i in range(3):
        a, b, c = R[i, 0], R[i, 1], R[i, 2]
        u, v, w = b * z - c * y, c * x - a * z, a * y - b * x
        R[i, 0] = a + first * u + second * (v * z - w * y)
        R[i, 1] = b + first * v + second * (w * x - u * z)
        R[i, 2] = c + first * w + second * (u * y - v * x)


@compiled_into_caller
def quaternion_of(R: FloatArray) -> tuple[float, float, float, float]:
    """The unit quaternion (x, y, z, w) of a rotation matrix, w ≥ 0.

    References:
        Shepperd (1978), Journal of Guidance and Control 1(3): from the largest component.
    """
    xx, yy, zz = R[0, 0], R[1, 1], R[2, 2]
    trace = xx + yy + zz
    if trace > max(xx, yy, zz):
        x, y, z = R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]
        w = 1.0 + trace
    elif xx >= yy and xx >= zz:
        x, y, z = 1.0 - trace + 2.0 * xx, R[1, 0] + R[0, 1], R[2, 0] + R[0, 2]
        w = R[2, 1] - R[1, 2]
    elif yy >= zz:
        x, y, z = R[1, 0] + R[0, 1], 1.0 - trace + 2.0 * yy, R[2, 1] + R[1, 2]
        w = R[0, 2] - R[2, 0]
    else:
        x, y, z = R[2, 0] + R[0, 2], R[2, 1] + R[1, 2], 1.0 - trace + 2.0 * zz
        w = R[1, 0] - R[0, 1]
    length = np.sqrt(x * x + y * y + z * z + w * w)
    if w < 0.0:
        length = -length
    return x / length, y / length, z / length, w / length


@compiled_in_place
def quaternion(R: FloatArray, out: FloatArray) -> None:
    """Fill an array, (4,), with the unit quaternion of a rotation matrix."""
    out[0], out[1], out[2], out[3] = quaternion_of(R)


@compiled_in_place
def vector_scale(x: float, y: float, z: float, w: float) -> float:
    """Factor from a unit quaternion's x, y, z to the rotation vector."""
    sign = 1.0 if w >= 0.0 else -1.0
    sine = np.sqrt(x * x + y * y + z * z)  # of half the angle
    if sine < SMALL_ANGLE:
        return sign * (2.0 + sine * sine / 3.0)
    return sign * 2.0 * np.arctan2(sine, sign * w) / sine


@compiled_in_place
def logarithm(R: FloatArray, out: FloatArray) -> None:
    """The rotation vector [rad], of length at most π, of a rotation matrix."""
    x, y, z, w = quaternion_of(R)
    scale = vector_scale(x, y, z, w)
    out[0], out[1], out[2] = scale * x, scale * y, scale * z


@compiled_in_place
def matrix_of_quaternion(q: FloatArray, out: FloatArray) -> None:
    """The rotation matrix of a quaternion (x, y, z, w) of any length."""
    x, y, z, w = q[0], q[1], q[2], q[3]
    scale = 2.0 / (x * x + y * y + z * z + w * w)
    out[0, 0] = 1.0 - scale * (y * y + z * z)
    out[1, 1] = 1.0 - scale * (x * x + z * z)
    out[2, 2] = 1.0 - scale * (x * x + y * y)
    out[0, 1], out[1, 0] = scale * (x * y - w * z), scale * (x * y + w * z)
    out[0, 2], out[2, 0] = scale * (x * z + w * y), scale * (x * z - w * y)
    out[1, 2], out[2, 1] = scale * (y * z - w * x), scale * (y * z + w * x)


@compiled_in_place
def product(A: FloatArray, B: FloatArray, out: FloatArray) -> None:
    """A B of (3, 3) matrices; ``out`` is neither of them."""
    for i in range(3):
        for j in range(3):
            out[i, j] = A[i, 0] * B[0, j] + A[i, 1] * B[1, j] + A[i, 2] * B[2, j]


@compiled_in_place
def product_transposed(A: FloatArray, B: FloatArray, out: FloatArray) -> None:
    """A Bᵀ of (3, 3) matrices; ``out`` is neither of them."""
    for i in range(3):
        for j in range(3):
            out[i, j] = A[i, 0] * B[j, 0] + A[i, 1] * B[j, 1] + A[i, 2] * B[j, 2]


@compiled_in_place
def transposed_product(A: FloatArray, B: FloatArray, out: FloatArray) -> None:
    """Aᵀ B of (3, 3) matrices; ``out`` is neither of them."""
    for i in range(3):
        for j in range(3):
            out[i, j] = A[0, i] * B[0, j] + A[1, i] * B[1, j] + A[2, i] * B[2, j]
