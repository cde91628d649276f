"""A depth camera's skeleton tracker: the model of :mod:`pose_core.filters.tracker_model`."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pose_core.kernels.compiling import compiled_in_place
from pose_core.streams.samples import FloatArray

FASTEST = 1.6  # [m/s] beyond which the noise grows no more


class TrackerNumbers(NamedTuple):
    """The fields of :class:`pose_core.filters.tracker_model.TrackerNoise`."""

    stddev: float
    depth_stddev: float
    moving_stddev: float
    lag_stddev: float
    foreshortened_stddev: float
    inferred_factor: float
    correlation_factor: float
    student_dof: float
    inertia: float
    quick: float
    inertia_foreshortened: float
    inertia_inferred: float
    memory: float


@compiled_in_place
def foreshortening(
    joints: FloatArray, rays: FloatArray, limb_ends: NDArray[np.int64], out: FloatArray
) -> None:
    """How far the limb that ends in a joint points along the line of sight: cos⁴ of the angle.

    Args:
        joints: (joints, 3) [m].
        rays: Unit vectors from the camera to the joints, (joints, 3).
        limb_ends: (limbs, 2) the far and the near joint of each.
        out: (joints,), zero for the trunk's joints.
    """
    out[:] = 0.0
    for far, near in limb_ends:
        dot = squared = 0.0
        for axis in range(3):
            along = joints[far, axis] - joints[near, axis]
            dot += along * rays[far, axis]
            squared += along * along
        out[far] = (dot * dot / squared) ** 2


@compiled_in_place
def inertia(noise: TrackerNumbers, speed: float, pointing: float, is_inferred: bool) -> float:
    """The share a of a joint's past in what the tracker says now."""
    difficulty = (speed / noise.quick) ** 2 + noise.inertia_foreshortened * pointing
    if is_inferred:
        difficulty += noise.inertia_inferred
    return noise.inertia * min(max(difficulty, 0.0), 1.0)


@compiled_in_place
def noise_covariance(
    noise: TrackerNumbers,
    ray: FloatArray,
    velocity: FloatArray,
    speed: float,
    pointing: float,
    is_inferred: bool,
    out: FloatArray,
) -> None:
    """Covariance of a joint's measurement, (3, 3) [m²]."""
    isotropic = noise.stddev**2 + (noise.moving_stddev * min(speed, FASTEST) ** 1.5) ** 2
    isotropic += (noise.foreshortened_stddev * pointing) ** 2
    scale = noise.correlation_factor * (noise.inferred_factor if is_inferred else 1.0)
    for i in range(3):
        for k in range(3):
            out[i, k] = noise.depth_stddev**2 * ray[i] * ray[k]
            out[i, k] += noise.lag_stddev**2 * velocity[i] * velocity[k]
        out[i, i] += isotropic
    for i in range(3):
        for k in range(3):
            out[i, k] *= scale**2


@compiled_in_place
def student_factor(noise: TrackerNumbers, distance: float) -> float:
    """How far a sample's covariance is enlarged, at least 1.

    Args:
        noise: The numbers.
        distance: Squared Mahalanobis distance of the innovation, 3 degrees of freedom.
    """
    return max(1.0, (noise.student_dof + distance) / (noise.student_dof + 3.0))
