"""Quaternion arithmetic, faster than the libraries' for a few rows.

Quaternions are (x, y, z, w), arrays of shape (k, 4).
"""

import numpy as np

from pose_core.arrays import FloatArray


def cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Cross products, shape (k, 3): ten times as fast as numpy's for few rows."""
    ax, ay, az = a.T
    bx, by, bz = b.T
    product = np.empty((len(b), 3))
    product[:, 0] = ay * bz - az * by
    product[:, 1] = az * bx - ax * bz
    product[:, 2] = ax * by - ay * bx
    return product


def rotate(q: FloatArray, vectors: FloatArray, *, inverse: bool = False) -> FloatArray:
    """Rotate vectors from sensor to world axes, or the inverse, shape (k, 3)."""
    axis = -q[:, :3] if inverse else q[:, :3]
    t = 2.0 * cross(axis, vectors)
    return vectors + q[:, 3:] * t + cross(axis, t)


def multiply(p: FloatArray, q: FloatArray) -> FloatArray:
    """Quaternion products, shape (k, 4)."""
    px, py, pz, pw = p.T
    qx, qy, qz, qw = q.T
    product = np.empty((len(q), 4))
    product[:, 0] = pw * qx + px * qw + py * qz - pz * qy
    product[:, 1] = pw * qy - px * qz + py * qw + pz * qx
    product[:, 2] = pw * qz + px * qy - py * qx + pz * qw
    product[:, 3] = pw * qw - px * qx - py * qy - pz * qz
    return product


def from_rotation_vector(turn: FloatArray) -> FloatArray:
    """Quaternions of rotation vectors [rad], shape (k, 4)."""
    half = 0.5 * np.linalg.norm(turn, axis=1, keepdims=True)
    # np.sinc(x) is sin(pi x) / (pi x), defined at zero.
    return np.concatenate([0.5 * turn * np.sinc(half / np.pi), np.cos(half)], axis=1)


def from_matrix(R: FloatArray) -> FloatArray:
    """Quaternions of rotation matrices, shape (k, 3, 3), by the largest of their four parts."""
    diagonal = np.diagonal(R, axis1=1, axis2=2)
    trace = diagonal.sum(axis=1)
    # Each row is 4 q_i (x, y, z, w) for i = x, y, z, w.
    rows = np.empty((len(R), 4, 4))
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        rows[:, i, i] = 1.0 + 2.0 * R[:, i, i] - trace
        rows[:, i, j] = rows[:, j, i] = R[:, i, j] + R[:, j, i]
        rows[:, i, 3] = rows[:, 3, i] = R[:, k, j] - R[:, j, k]
    rows[:, 3, 3] = 1.0 + trace
    largest = np.argmax(np.diagonal(rows, axis1=1, axis2=2), axis=1)
    q = rows[np.arange(len(R)), largest]
    return q / np.linalg.norm(q, axis=1, keepdims=True)
