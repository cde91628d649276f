"""Rigid transforms as matrices: composition, application to points, inverse, best fit."""

import numpy as np
from numpy.typing import ArrayLike

from pose_core.arrays import FloatArray


def rigid_transform(R: ArrayLike, position: ArrayLike) -> FloatArray:
    """Transform, shape (4, 4), of a rotation (3, 3) and a position [m]."""
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, position
    return T


def transformed(T_target_source: FloatArray, points: FloatArray) -> FloatArray:
    """Transform points [m], shape (..., 3), to another frame."""
    return points @ T_target_source[:3, :3].T + T_target_source[:3, 3]


def inverse(T_target_source: FloatArray) -> FloatArray:
    """``T_source_target`` of a rigid transform, shape (4, 4)."""
    R = T_target_source[:3, :3]
    return rigid_transform(R.T, -R.T @ T_target_source[:3, 3])


def best_rigid_transform(
    source: FloatArray, target: FloatArray, weights: FloatArray | None = None
) -> FloatArray:
    r"""Least-squares transform between clouds of matched points; their shape is not checked.

    .. math:: \min_{R, t} \sum_i w_i \| p^{target}_i - (R\,p^{source}_i + t) \|^2

    Args:
        source: Points in the source frame, shape (..., n, 3) [m].
        target: The same points in the target frame, shape (..., n, 3) [m].
        weights: Shape (..., n) [-], equal ones if None.

    Returns:
        ``T_target_source``, shape (..., 4, 4).

    References:
        Kabsch (1976), Acta Cryst. A32; Umeyama (1991), IEEE TPAMI 13(4), with unit scale.
    """
    weights = np.ones(source.shape[:-1]) if weights is None else weights
    share = weights / weights.sum(axis=-1, keepdims=True)
    mean_source = (share[..., None, :] @ source)[..., 0, :]
    mean_target = (share[..., None, :] @ target)[..., 0, :]
    centred_source = source - mean_source[..., None, :]
    centred_target = target - mean_target[..., None, :]
    weighted = share[..., None] * centred_target
    covariance = np.swapaxes(weighted, -1, -2) @ centred_source
    U, _, Vt = np.linalg.svd(covariance)
    U[..., :, 2] *= np.sign(np.linalg.det(U @ Vt))[..., None]  # a rotation, no reflection
    R = U @ Vt
    T = np.zeros((*R.shape[:-2], 4, 4))
    T[..., :3, :3] = R
    T[..., :3, 3] = mean_target - np.einsum("...ij,...j->...i", R, mean_source)
    T[..., 3, 3] = 1.0
    return T
