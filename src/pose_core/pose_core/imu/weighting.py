r"""Kinect and IMU, weighted: zhang2015 (12), (13), on every segment that carries an IMU.

Both measure one attitude with independent noise of variance σ₁² (Kinect) and σ₂² (IMU); the
unbiased weights of minimum variance are w₁ = σ₂²/(σ₁²+σ₂²), w₂ = σ₁²/(σ₁²+σ₂²). While the Kinect
does not track a segment, (w₁, w₂) = (0, 1). A limb's axial rotation, which no camera measures,
comes only from the IMU.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from pose_core.arrays import FloatArray

NEARLY_PARALLEL = 1e-9


@dataclass(frozen=True, kw_only=True)
class Weights:
    """Weights of the two sources, and the variance of their weighted mean."""

    kinect: float
    imu: float
    variance: float  # [rad²]


def minimum_variance_weights(
    kinect_variance: float, imu_variance: float, *, is_tracked: bool
) -> Weights:
    """Minimum-variance weights of the two attitudes.

    Args:
        kinect_variance: σ₁² [rad²].
        imu_variance: σ₂² [rad²].
        is_tracked: Whether the Kinect tracks the joints that define the segment.
    """
    if not is_tracked:
        return Weights(kinect=0.0, imu=1.0, variance=imu_variance)
    total = kinect_variance + imu_variance
    return Weights(
        kinect=imu_variance / total,  # zhang2015 (12)
        imu=kinect_variance / total,  # zhang2015 (13)
        variance=kinect_variance * imu_variance / total,
    )


def fuse_trunk(R_kinect: FloatArray, R_imu: FloatArray, imu_weight: float) -> FloatArray:
    """Weighted mean of two full rotations of a segment, shape (3, 3).

    The mean lies on the shortest rotation from one to the other.
    """
    turn = Rotation.from_matrix(R_kinect.T @ R_imu).as_rotvec()
    return R_kinect @ Rotation.from_rotvec(imu_weight * turn).as_matrix()


def fuse_limb(R_kinect: FloatArray, R_imu: FloatArray, imu_weight: float) -> FloatArray:
    """Weighted mean of a limb's direction, with the axial rotation of the IMU, shape (3, 3).

    The IMU's rotation is followed by the smallest rotation that brings its long axis, z, to the
    mean direction.
    """
    axis = np.cross(R_imu[:, 2], R_kinect[:, 2])
    sine, cosine = float(np.linalg.norm(axis)), float(R_imu[:, 2] @ R_kinect[:, 2])
    if sine < NEARLY_PARALLEL:  # equal or opposite: use the IMU's
        return R_imu
    angle = np.arctan2(sine, cosine)
    return Rotation.from_rotvec((1.0 - imu_weight) * angle * axis / sine).as_matrix() @ R_imu
