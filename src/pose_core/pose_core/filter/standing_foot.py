r"""Standing foot: while no camera sees the person, the foot on the floor carries the root.

A foot that stands does not move. With an IMU on thigh and shank, the links' rates tell how the root
moves over it:

.. math:: -\sum_l \omega_l \times r_l = v + n, \quad
          \sigma_n = \sigma_0 + \sigma_h \, (h - h_\mathrm{lowest})

with the lever arms r of the links that carry the foot, and its height h. The higher foot counts
less, since it swings; which of the two stands is also told by the velocity before, through the
heavy tails of n. The shank is taken as longer than to the ankle: the foot rolls over heel and ball.
"""

import numpy as np
from numpy.typing import NDArray

from pose_core.filter.rows import Rows, add_group
from pose_core.filter.state import FilterState
from pose_core.joints import JOINT_PAIRS, JOINTS
from pose_core.kernels.compiling import compiled, compiled_in_place
from pose_core.kernels.joint_kinematics import (
    BodyArrays,
    compute_joint_velocities,
    compute_joints,
)

LEFT_FOOT, RIGHT_FOOT = JOINT_PAIRS["foot"]
STDDEV = 0.1  # [m/s]
STDDEV_OF_HEIGHT = 8.0  # [1/s] in addition, for each metre above the lower foot
STUDENT_DOF = 1.0  # [-]
LONGER_SHANK = 1.2  # [-]


@compiled
def add_standing_foot_rows(body: BodyArrays, state: FilterState, rows: Rows) -> None:
    """Add three rows for each foot, if all links of the legs have an IMU."""
    pose = state.pose
    levers, joints = np.zeros((len(JOINTS), len(pose.rates), 3)), np.empty((len(JOINTS), 3))
    from_root = np.empty((len(JOINTS), 3))
    compute_joints(body, pose.position, pose.rotations, pose.slides, levers, joints)
    for foot in (LEFT_FOOT, RIGHT_FOOT):
        if not has_imus(body, foot, state.has_imu):
            return
        shank = body.carriers[foot, body.carrier_count[foot] - 1]
        levers[foot, shank] *= LONGER_SHANK
    compute_joint_velocities(body, levers, np.zeros(3), pose.rates, from_root)
    lowest = min(joints[LEFT_FOOT, 2], joints[RIGHT_FOOT, 2])
    for foot in (LEFT_FOOT, RIGHT_FOOT):
        group = add_group(rows, 3, STUDENT_DOF, foot)
        first, velocity = rows.first[group], state.layout.first_rate
        stddev = STDDEV + STDDEV_OF_HEIGHT * (joints[foot, 2] - lowest)
        for axis in range(3):
            rows.residual[first + axis] = -from_root[foot, axis] - pose.velocity[axis]
            rows.noise[group, axis, axis] = stddev**2
            rows.H[first + axis, velocity + axis] = 1.0


@compiled_in_place
def has_imus(body: BodyArrays, joint: int, has_imu: NDArray[np.bool_]) -> bool:
    """Whether an IMU measures each link that carries a joint; the root needs none."""
    for c in range(body.carrier_count[joint]):
        link = body.carriers[joint, c]
        if link > 0 and not has_imu[link]:
            return False
    return True
