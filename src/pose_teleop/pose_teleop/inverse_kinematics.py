r"""Inverse kinematics of an arm by damped least squares.

Minimises :math:`\sum_i w_i^2 \|e_i(q)\|^2 + w_r^2 \|q - q_{rest}\|^2` within the joints' limits,
where :math:`e` are the errors of the tool's position, the elbow's position and the tool's
direction.
Each iteration solves :math:`(J^T W J + (w_r^2 + \lambda^2) I)\,\Delta q = J^T W e + w_r^2 (q_{rest}
- q)`.
"""

from dataclasses import dataclass

import numpy as np

from pose_core.api import FloatArray
from pose_teleop.robot_arm import RobotArm

ELBOW_WEIGHT = 0.25  # [-] of the elbow's position, relative to the tool's
DIRECTION_WEIGHT = 0.05  # [m/rad] of the tool's direction
REST_WEIGHT = 0.02  # [m/rad] of the distance to the rest posture
DAMPING = 0.02  # [m/rad]
MAX_STEP = 0.3  # [rad] of a joint per iteration
CONVERGED = 1e-4  # [rad]


@dataclass(frozen=True, kw_only=True)
class ArmGoal:
    """Goal of the arm in the robot's root frame."""

    elbow: FloatArray  # [m] (3,)
    tool: FloatArray  # [m] (3,)
    direction: FloatArray  # (3,) unit vector along the forearm


def reach(arm: RobotArm, goal: ArmGoal, start: FloatArray, iterations: int) -> FloatArray:
    """Joint angles [rad], (n,), that reach a goal, near to the initial ones.

    Args:
        arm: The robot's arm.
        goal: The goal.
        start: The initial angles [rad], (n,).
        iterations: Largest number of steps.
    """
    q = np.clip(start, arm.lower, arm.upper)
    for _ in range(iterations):
        step = _step(arm, goal, q)
        step *= min(1.0, MAX_STEP / (np.abs(step).max() + 1e-12))
        before, q = q, np.clip(q + step, arm.lower, arm.upper)
        if np.abs(q - before).max() < CONVERGED:
            break
    return q


def _step(arm: RobotArm, goal: ArmGoal, q: FloatArray) -> FloatArray:
    frames = arm.file
    arm.update(q)
    tool, R = arm.place(frames.tool)
    elbow, _ = arm.place(frames.elbow)
    axis = R @ np.array(frames.tool_axis)
    J_tool, J_elbow = arm.jacobian(frames.tool), arm.jacobian(frames.elbow)
    errors = np.concatenate(
        [
            goal.tool - tool,
            ELBOW_WEIGHT * (goal.elbow - elbow),
            DIRECTION_WEIGHT * _cross(axis, goal.direction),  # rotation that aligns them
        ]
    )
    J = np.vstack([J_tool[:3], ELBOW_WEIGHT * J_elbow[:3], DIRECTION_WEIGHT * J_tool[3:]])
    H = J.T @ J + (REST_WEIGHT**2 + DAMPING**2) * np.eye(len(q))
    gradient = J.T @ errors + REST_WEIGHT**2 * (arm.rest - q)
    return np.asarray(np.linalg.solve(H, gradient))


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Cross product of two vectors; ``numpy.cross`` would take half the solver's time."""
    (ax, ay, az), (bx, by, bz) = a.tolist(), b.tolist()
    return np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])
