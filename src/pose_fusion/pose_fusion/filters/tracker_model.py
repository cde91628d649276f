r"""What a depth camera's skeleton tracker makes of a joint: its measurement model and its noise.

A tracker that sees a joint badly, because it moves fast, points at the camera or is hidden, draws
it to where it was of late:

.. math:: z = p + a\,(m - p) + b + \mathrm{noise}, \quad
          a = a_\mathrm{max}\,\mathrm{clip}((v / v_q)^2 + c_f f + c_h h, 0, 1)

with p the joint relative to the root, m its recent mean, v its speed, f how far the limb points
along the line of sight, h whether the sensor calls it inferred, and b the sensor's constant offset
of this joint. The noise grows with speed, depth and foreshortening; a sample far off what the
filter expects counts less (Student's t).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pose_common.joints import JOINT_INDEX, SIDES, TrackingState
from pose_fusion.streams.samples import FloatArray

LIMB_ENDS = tuple(
    (JOINT_INDEX[f"{side}_{far}"], JOINT_INDEX[f"{side}_{near}"])
    for side in SIDES
    for far, near in (("elbow", "shoulder"), ("hand", "elbow"), ("knee", "hip"), ("foot", "knee"))
)
FAR, NEAR = (np.array(ends) for ends in zip(*LIMB_ENDS, strict=True))
FASTEST = 1.6  # [m/s] beyond which the noise grows no more


@dataclass(frozen=True, kw_only=True)
class TrackerNoise:
    """Numbers of the model; docs/algorithm.md says where each comes from."""

    stddev: float = 0.02  # [m] of a tracked joint, in every direction
    depth_stddev: float = 0.008  # [m] more along the line of sight
    moving_stddev: float = 0.02  # [m] more at 1 m/s, in every direction
    lag_stddev: float = 0.0245  # [s] more along the velocity
    foreshortened_stddev: float = 0.03  # [m] more where the limb points at the camera
    inferred_factor: float = 3.66  # [-] how much worse an inferred joint is
    correlation_factor: float = 2.44  # [-] errors are slow: many samples count as one
    student_dof: float = 13.3  # [-] of Student's t
    inertia: float = 0.6  # [-] a_max
    quick: float = 1.31  # [m/s] v_q
    inertia_foreshortened: float = 0.5  # [-] c_f
    inertia_inferred: float = 0.11  # [-] c_h
    memory: float = 1.15  # [s] time constant of m


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
