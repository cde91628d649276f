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
