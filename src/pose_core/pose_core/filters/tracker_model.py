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

from pose_core.joints import JOINT_INDEX, SIDES
from pose_core.kernels.tracker import TrackerNumbers

LIMB_ENDS = np.array(
    [
        (JOINT_INDEX[f"{side}_{far}"], JOINT_INDEX[f"{side}_{near}"])
        for side in SIDES
        for far, near in (
            ("elbow", "shoulder"),
            ("hand", "elbow"),
            ("knee", "hip"),
            ("foot", "knee"),
        )
    ],
    np.int64,
)
"""The joint that each limb ends in, and the one that it begins at."""


@dataclass(frozen=True, kw_only=True)
class TrackerNoise:
    """Numbers of the model; docs/algorithm.md says where each comes from."""

    stddev: float = 0.02  # [m] of a tracked joint, in every direction
    depth_stddev: float = 0.008  # [m] more along the line of sight
    moving_stddev: float = 0.01  # [m] more at 1 m/s, in every direction
    lag_stddev: float = 0.012  # [s] more along the velocity
    foreshortened_stddev: float = 0.03  # [m] more where the limb points at the camera
    inferred_factor: float = 3.66  # [-] how much worse an inferred joint is
    correlation_factor: float = 1.2  # [-] errors are slow: many samples count as one
    student_dof: float = 13.3  # [-] of Student's t
    inertia: float = 0.1  # [-] a_max
    quick: float = 2.6  # [m/s] v_q
    inertia_foreshortened: float = 0.5  # [-] c_f
    inertia_inferred: float = 0.11  # [-] c_h
    memory: float = 1.15  # [s] time constant of m


def tracker_numbers(noise: TrackerNoise) -> TrackerNumbers:
    """The numbers as the kernels take them."""
    return TrackerNumbers(**{name: float(value) for name, value in vars(noise).items()})
