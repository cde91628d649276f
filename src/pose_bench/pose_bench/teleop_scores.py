"""Evaluation of tele-operation from the bag of a run."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.errors import InputError
from pose_core.stamps import nanoseconds
from pose_io.arrays import IntArray
from pose_io.bags import BagReader, open_bag
from pose_io.robot_motion import COMMAND, ROBOT, TARGET, JointMotion, read_joint_motion
from pose_teleop.arm_controller import command_limits
from pose_teleop.parameters import ArmParameters
from pose_teleop.robot_arm import RobotArm
from pose_teleop.robot_files import load_robot

MAX_STEP_NS = 100_000_000  # [ns] longest interval between targets without an interruption
TRAJECTORY = "/arm/joint_trajectory"


class NotFollowedError(InputError):
    """A bag without tele-operation."""


@dataclass(frozen=True, kw_only=True)
class TeleopScores:
    """Figures of one run.

    Attributes:
        commands: Number of commands.
        followed: Share of the time between the first and the last command in which the robot
            followed the person, including soft starts [-].
        tool_mm: (n,) distance of the robot's tool from its target [mm].
        latency_ms: (m,) from the capture of the pose to the arrival of the command [ms].
        jerk: 99th percentile of the commands' jerk, relative to its limit [-].
        beyond: Excess of commands over limits: position [rad], velocity and acceleration relative
            to the limit [-].
        robot_beyond: Excess of the robot's joints: position [rad], velocity relative to the
            URDF's [-].
    """

    commands: int
    followed: float
    tool_mm: FloatArray
    latency_ms: FloatArray
    jerk: float
    beyond: tuple[float, float, float]
    robot_beyond: tuple[float, float]


def score_teleop(bag_path: Path) -> TeleopScores:
    """Evaluate a run of a G1's left arm.

    Raises:
        NotFollowedError: If the bag contains no tele-operation.
    """
    arm = RobotArm(load_robot("g1", "left"))
    with open_bag(bag_path) as bag:
        found = [read_joint_motion(bag, topic) for topic in (TARGET, COMMAND, ROBOT)]
        sent_ns, trajectories = _first_points(bag)
    if any(each is None for each in found) or not len(trajectories):
        raise NotFollowedError(f"{bag_path} holds no tele-operation: the robot never followed")
    target, command, measured = (each for each in found if each is not None)
    limits = command_limits(arm, ArmParameters())
    position, velocity, acceleration = (trajectories[:, i] for i in range(3))
    moved = measured.position
    steps_ns = np.diff(target.recorded_ns)
    is_new = np.concatenate([[True], np.diff(command.stamps_ns) > 0])  # others are the timer's
    return TeleopScores(
        commands=len(command.stamps_ns),
        # Only while a person is followed, targets are published.
        followed=float(
            steps_ns[steps_ns < MAX_STEP_NS].sum() / max(np.ptp(command.recorded_ns), 1)
        ),
        tool_mm=_tool_errors_mm(arm, target, measured),
        latency_ms=(command.recorded_ns - command.stamps_ns)[is_new] * 1e-6,
        jerk=_jerk_p99(sent_ns, acceleration) / float(limits.jerk.max()),
        beyond=(
            float(np.maximum(position - limits.upper, limits.lower - position).max()),
            float((np.abs(velocity) / limits.velocity).max() - 1.0),
            float((np.abs(acceleration) / limits.acceleration).max() - 1.0),
        ),
        robot_beyond=(
            float(np.maximum(moved - arm.upper, arm.lower - moved).max()),
            float((np.abs(measured.velocity) / arm.max_velocity).max() - 1.0),
        ),
    )


def _first_points(bag: BagReader) -> tuple[IntArray, FloatArray]:
    """Time of each command [ns], (n,), and position, velocity, acceleration, (n, 3, d)."""
    sent_ns, points = [], []
    for message in bag.messages([TRAJECTORY]):
        content = bag.deserialize(message)
        first = content.points[0]
        sent_ns.append(nanoseconds(content.header.stamp))
        points.append([first.positions, first.velocities, first.accelerations])
    return np.array(sent_ns, np.int64), np.array(points, float)


def _jerk_p99(sent_ns: IntArray, acceleration: FloatArray) -> float:
    """99th percentile of the jerk between accelerations of consecutive commands [rad/s³]."""
    step_s = np.diff(sent_ns) * 1e-9
    together = (step_s > 0.002) & (step_s < 0.03)
    jerk = np.abs(np.diff(acceleration, axis=0)).max(axis=1) / np.maximum(step_s, 0.002)
    return float(np.percentile(jerk[together], 99.0)) if together.any() else float("nan")


def _tool_errors_mm(arm: RobotArm, target: JointMotion, measured: JointMotion) -> FloatArray:
    """Distance of the robot's tool from its target [mm] at each target's arrival, (n,)."""
    errors = np.empty(len(target.stamps_ns))
    for row, when_ns in enumerate(target.recorded_ns):
        at = min(int(np.searchsorted(measured.recorded_ns, when_ns)), len(measured.position) - 1)
        places = []
        for q in (target.position[row], measured.position[at]):
            arm.update(q)
            places.append(arm.place(arm.file.tool)[0].copy())
        errors[row] = 1e3 * np.linalg.norm(places[0] - places[1])
    return errors
