r"""Rotations one at a time: matrices, rotation vectors, quaternions.

.. math:: \exp([v]_\times) = I + \frac{\sin\theta}{\theta} [v]_\times
          + \frac{1 - \cos\theta}{\theta^2} [v]_\times^2, \quad \theta = |v|
"""

import numpy as np

from pose_fusion.kernels.compiling import compiled
from pose_fusion.streams.samples import FloatArray

SMALL_ANGLE = 1e-6  # [rad] below it, series replace sin x / x and (1 - cos x) / x²


@compiled
def exponential(x: float, y: float, z: float, out: FloatArray) -> None:
    """The rotation matrix of a rotation vector [rad]."""
    squared = x * x + y * y + z * z
    angle = np.sqrt(squared)
    if angle < SMALL_ANGLE:
        first, second = 1.0 - squared / 6.0, 0.5 - squared / 24.0
    else:
        first, second = np.sin(angle) / angle, (1.0 - np.cos(angle)) / squared
    out[0, 0] = 1.0 - second * (y * y + z * z)
    out[1, 1] = 1.0 - second * (x * x + z * z)
    out[2, 2] = 1.0 - second * (x * x + y * y)
    out[0, 1], out[1, 0] = second * x * y - first * z, second * x * y + first * z
    out[0, 2], out[2, 0] = second * x * z + first * y, second * x * z - first * y
    out[1, 2], out[2, 1] = second * y * z - first * x, second * y * z + first * x


@compiled
def quaternion(R: FloatArray, out: FloatArray) -> None:
    """The unit quaternion (x, y, z, w) of a rotation matrix, w ≥ 0.

    References:
        Shepperd (1978), Journal of Guidance and Control 1(3): from the largest component.
    """
    trace = R[0, 0] + R[1, 1] + R[2, 2]
    largest = 0
    for axis in range(1, 3):
        if R[axis, axis] > R[largest, largest]:
            largest = axis
    if trace > R[largest, largest]:
        out[0], out[1] = R[2, 1] - R[1, 2], R[0, 2] - R[2, 0]
        out[2], out[3] = R[1, 0] - R[0, 1], 1.0 + trace
    else:
        i = largest
        j, k = (i + 1) % 3, (i + 2) % 3
        out[i] = 1.0 - trace + 2.0 * R[i, i]
        out[j], out[k] = R[j, i] + R[i, j], R[k, i] + R[i, k]
        out[3] = R[k, j] - R[j, k]
    length = np.sqrt(out[0] ** 2 + out[1] ** 2 + out[2] ** 2 + out[3] ** 2)
    if out[3] < 0.0:
        length = -length
    for index in range(4):
        out[index] /= length


@compiled
def vector_of_quaternion(q: FloatArray, out: FloatArray) -> None:
    """The rotation vector [rad], of length at most π, of a unit quaternion (x, y, z, w)."""
    sign = 1.0 if q[3] >= 0.0 else -1.0
    sine = np.sqrt(q[0] ** 2 + q[1] ** 2 + q[2] ** 2)  # of half the angle
    if sine < SMALL_ANGLE:
        scale = 2.0 + sine * sine / 3.0
    else:
        scale = 2.0 * np.arctan2(sine, sign * q[3]) / sine
    for axis in range(3):
        out[axis] = sign * scale * q[axis]


@compiled
def logarithm(R: FloatArray, out: FloatArray) -> None:
    """The rotation vector [rad], of length at most π, of a rotation matrix."""
    q = np.empty(4)
    quaternion(R, q)
    vector_of_quaternion(q, out)


@compiled
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


@compiled
def product(A: FloatArray, B: FloatArray, out: FloatArray) -> None:
    """A B of (3, 3) matrices; ``out`` is neither of them."""
    for i in range(3):
        for j in range(3):
            out[i, j] = A[i, 0] * B[0, j] + A[i, 1] * B[1, j] + A[i, 2] * B[2, j]


@compiled
def product_transposed(A: FloatArray, B: FloatArray, out: FloatArray) -> None:
    """A Bᵀ of (3, 3) matrices; ``out`` is neither of them."""
    for i in range(3):
        for j in range(3):
            out[i, j] = A[i, 0] * B[j, 0] + A[i, 1] * B[j, 1] + A[i, 2] * B[j, 2]


@compiled
def transposed_product(A: FloatArray, B: FloatArray, out: FloatArray) -> None:
    """Aᵀ B of (3, 3) matrices; ``out`` is neither of them."""
    for i in range(3):
        for j in range(3):
            out[i, j] = A[0, i] * B[0, j] + A[1, i] * B[1, j] + A[2, i] * B[2, j]


@compiled
def turn_all(vectors: FloatArray, scale: float, R: FloatArray, out: FloatArray) -> None:
    """exp(scale · v) R for many at once, shapes (n, 3) and (n, 3, 3); ``out`` is not R."""
    turn = np.empty((3, 3))
    for index in range(len(R)):
        v = vectors[index]
        exponential(scale * v[0], scale * v[1], scale * v[2], turn)
        product(turn, R[index], out[index])


@compiled
def turns_between(A: FloatArray, B: FloatArray, out: FloatArray) -> None:
    """The rotation vectors [rad] of A Bᵀ, shapes (n, 3, 3) to (n, 3)."""
    relative = np.empty((3, 3))
    for index in range(len(A)):
        product_transposed(A[index], B[index], relative)
        logarithm(relative, out[index])
