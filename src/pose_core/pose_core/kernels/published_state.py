"""What is published of a filter state, before and after its angles are extracted."""

from enum import IntEnum
from typing import NamedTuple

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.kernels.compiling import compiled_into_caller

CAMERAS, IMUS = 0, 1  # the sources, as rows of the information


class Source(IntEnum):
    """Source of a degree of freedom's last update; the values are those of ``PoseEstimate``."""

    PREDICTED = 0
    KINECT = 1
    IMU = 2
    FUSED = 3


class PublishedState(NamedTuple):
    """The published part of a filter state; for n states, n rows of each."""

    position: FloatArray  # (3,) [m] of the root
    velocity: FloatArray  # (3,) [m/s]
    rotations: FloatArray  # (links, 3, 3): R_map_link
    rates: FloatArray  # (links, 3) [rad/s] in map
    joints: FloatArray  # (joints, 3) [m] in map, including slides
    position_variance: FloatArray  # (3,) [m²] of the root's position
    covariance: FloatArray  # (links, 3, 3) [rad²] of each link's rotation relative to its parent
    information: FloatArray  # (2, links, 3, 3) [1/rad²] of CAMERAS, of IMUS
    scale: FloatArray  # (1,) [-] of the variances
    ahead_s: FloatArray  # (1,) [s] for which it is predicted


class DofEstimate(NamedTuple):
    """The d degrees of freedom of one state."""

    position: FloatArray  # (d,) [m] or [rad]
    velocity: FloatArray  # (d,) [m/s] or [rad/s]
    variance: FloatArray  # (d,) [m²] or [rad²] of the filter
    information: FloatArray  # (2, d) [1/rad²] of CAMERAS and IMUS in the last updates
    blended: FloatArray  # (d,) [m²] or [rad²] variance that output blending adds


@compiled_into_caller
def make_dof_estimate(size: int) -> DofEstimate:
    """Allocate an estimate of ``size`` degrees of freedom."""
    return DofEstimate(
        np.zeros(size), np.zeros(size), np.zeros(size), np.zeros((2, size)), np.zeros(size)
    )
