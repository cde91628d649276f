r"""Standing foot: while no camera sees the person, the foot on the floor carries the root.

A foot that stands does not move. With an IMU on thigh and shank, the links' rates tell how the root
would move over each foot f, with the lever arms r of the links that carry it:

.. math:: v_f = -\sum_l \omega_l \times r_{fl}, \quad
          \frac{\sum_f w_f v_f}{\sum_f w_f} = v + n, \quad
          w_f = \frac{1}{(1 + h_f / h_0)^2 \, (1 + |v_f - v|^2 / s^2)}

It also stands as high as feet have stood while a camera has seen them, on a flat floor.

The foot that stands is the lower one, by the height h above the other, and the one that goes on as
the root has moved: one that swings would carry it at another velocity. The shank is taken as longer
than to the ankle, because the foot rolls over heel and ball.
"""

import numpy as np
from numpy.typing import NDArray

from pose_core.arrays import FloatArray
from pose_core.filter.rows import NORMAL, Rows, add_group
from pose_core.filter.state import FilterState
from pose_core.joints import JOINT_PAIRS, JOINTS
from pose_core.kernels.compiling import compiled_in_place, compiled_into_caller
from pose_core.kernels.joint_kinematics import BodyArrays, compute_joint_velocities, compute_joints

LEFT_FOOT, RIGHT_FOOT = JOINT_PAIRS["foot"]
STDDEV = 0.1  # [m/s] n along each axis
HEIGHT = 0.1  # [m] h₀
SPEED = 0.3  # [m/s] s
HEIGHT_STDDEV = 0.05  # [m] of a standing foot's joint above the floor
HEIGHT_MEMORY_S = 2.0  # [s] over which the height of the lower foot is averaged
LONGER_SHANK = 1.2  # [-]


@compiled_into_caller
def add_standing_foot_rows(body: BodyArrays, state: FilterState, rows: Rows) -> None:
    """Add rows for the root's velocity and height, if all links of the legs have an IMU."""
    pose = state.pose
    levers, joints = np.zeros((len(JOINTS), len(pose.rates), 3)), np.empty((len(JOINTS), 3))
    compute_joints(body, pose.position, pose.rotations, pose.slides, levers, joints)
    for foot in (LEFT_FOOT, RIGHT_FOOT):
        if not has_imus(body, foot, state.imus.is_used):
            return
        shank = body.carriers[foot, body.carrier_count[foot] - 1]
        levers[foot, shank] *= LONGER_SHANK
    from_root = np.empty((len(JOINTS), 3))
    compute_joint_velocities(body, levers, np.zeros(3), pose.rates, from_root)
    lowest = min(joints[LEFT_FOOT, 2], joints[RIGHT_FOOT, 2])
    carried, weights = np.zeros(3), 0.0
    for foot in (LEFT_FOOT, RIGHT_FOOT):
        apart = np.sum((from_root[foot] + pose.velocity) ** 2)
        height = joints[foot, 2] - lowest
        weight = 1.0 / ((1.0 + height / HEIGHT) ** 2 * (1.0 + apart / SPEED**2))
        carried -= weight * from_root[foot]
        weights += weight
    group = add_group(rows, 3, NORMAL, LEFT_FOOT)
    first = rows.first[group]
    for axis in range(3):
        rows.residual[first + axis] = carried[axis] / weights - pose.velocity[axis]
        rows.noise[group, axis, axis] = STDDEV**2
        rows.H[first + axis, state.layout.first_rate + axis] = 1.0
    if np.isfinite(state.foot_height[0]):
        group = add_group(rows, 1, NORMAL, LEFT_FOOT)
        rows.residual[rows.first[group]] = state.foot_height[0] - lowest
        rows.noise[group, 0, 0] = HEIGHT_STDDEV**2
        rows.H[rows.first[group], 2] = 1.0


@compiled_in_place
def note_foot_height(joints: FloatArray, gap_s: float, state: FilterState) -> None:
    """Update the lower foot's height with the joints of a frame's prediction, (joints, 3) [m]."""
    lowest = min(joints[LEFT_FOOT, 2], joints[RIGHT_FOOT, 2])
    before = state.foot_height[0] if np.isfinite(state.foot_height[0]) else lowest
    state.foot_height[0] = before + (1.0 - np.exp(-gap_s / HEIGHT_MEMORY_S)) * (lowest - before)


@compiled_in_place
def has_imus(body: BodyArrays, joint: int, has_imu: NDArray[np.bool_]) -> bool:
    """Whether an IMU measures each link that carries a joint; the root needs none."""
    for c in range(body.carrier_count[joint]):
        link = body.carriers[joint, c]
        if link > 0 and not has_imu[link]:
            return False
    return True
