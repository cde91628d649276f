"""A depth camera's skeleton tracker in plain numpy: see ``pose_core.filters.tracker_model``."""

import numpy as np
from numpy.typing import NDArray

from pose_core.filters.tracker_model import LIMB_ENDS, TrackerNoise
from pose_core.joints import TrackingState
from pose_core.streams.samples import FloatArray

FAR, NEAR = LIMB_ENDS.T
FASTEST = 1.6  # [m/s] beyond which the noise grows no more


def foreshortening(joints: FloatArray, rays: FloatArray) -> FloatArray:
    """How far the limb that ends in a joint points along the line of sight.

    Args:
        joints: Shape (15, 3) [m].
        rays: Unit vectors from the camera to the joints, shape (15, 3).

    Returns:
        cos⁴ of the angle between both, shape (15,); zero for the trunk's joints.
    """
    limb = joints[FAR] - joints[NEAR]
    limb = limb / np.linalg.norm(limb, axis=1, keepdims=True)
    result = np.zeros(len(joints))
    result[FAR] = np.sum(limb * rays[FAR], axis=1) ** 4
    return result


def inertia(
    noise: TrackerNoise, speed: FloatArray, pointing: FloatArray, state: NDArray[np.uint8]
) -> FloatArray:
    """The share a of each joint's past in what the tracker says now, shape (15,)."""
    difficulty = (speed / noise.quick) ** 2 + noise.inertia_foreshortened * pointing
    difficulty = difficulty + noise.inertia_inferred * (state == TrackingState.INFERRED)
    return np.asarray(noise.inertia * np.clip(difficulty, 0.0, 1.0))


def covariances(
    noise: TrackerNoise,
    rays: FloatArray,
    velocity: FloatArray,
    pointing: FloatArray,
    state: NDArray[np.uint8],
) -> FloatArray:
    """Covariance of each joint's measurement.

    Args:
        noise: The numbers.
        rays: Unit vectors from the camera to the joints, shape (15, 3).
        velocity: Of the joints, shape (15, 3) [m/s].
        pointing: See :func:`foreshortening`, shape (15,).
        state: Tracking states, shape (15,).

    Returns:
        Shape (15, 3, 3) [m²].
    """
    pace = np.minimum(np.linalg.norm(velocity, axis=1), FASTEST)
    isotropic = noise.stddev**2 + (noise.moving_stddev * pace**1.5) ** 2
    isotropic = isotropic + (noise.foreshortened_stddev * pointing) ** 2
    R = isotropic[:, None, None] * np.eye(3)
    R = R + noise.depth_stddev**2 * rays[:, :, None] * rays[:, None, :]
    R = R + noise.lag_stddev**2 * velocity[:, :, None] * velocity[:, None, :]
    scale = np.where(state == TrackingState.INFERRED, noise.inferred_factor, 1.0)
    return np.asarray(R * (noise.correlation_factor * scale[:, None, None]) ** 2)


def student_weights(
    noise: TrackerNoise, innovation: FloatArray, covariance: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """How far the noise of each joint's sample is to be enlarged.

    Args:
        noise: The numbers.
        innovation: Shape (n, 3) [m].
        covariance: Of the innovation, shape (n, 3, 3) [m²].

    Returns:
        Factors of the covariance, shape (n,), at least 1, and the squared Mahalanobis distances.
    """
    solved = np.linalg.solve(covariance, innovation[..., None])[..., 0]
    distance = np.sum(innovation * solved, axis=1)
    factor = (noise.student_dof + distance) / (noise.student_dof + 3.0)
    return np.maximum(1.0, factor), distance
