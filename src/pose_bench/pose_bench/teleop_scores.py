"""How well a robot followed, judged by the bag of the run."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pose_core.api import FloatArray
from pose_core.errors import InputError
from pose_io.bags import BagReader, open_bag
from pose_io.robot_motion import COMMAND, ROBOT, TARGET, JointMotion, read_joint_motion
from pose_teleop.arm_controller import command_limits
from pose_teleop.parameters import ArmParameters
from pose_teleop.robot_arm import RobotArm
from pose_teleop.robot_files import load_robot

TRAJECTORY = "/arm/joint_trajectory"


@dataclass(frozen=True, kw_only=True)
class TeleopScores:
    """One run.

    Attributes:
        commands: How many there were.
        tool_mm: (n,) how far the robot's tool was from where the person's pose asks it to be [mm].
        latency_ms: (m,) from the capture that is followed to the command's arrival [ms].
        jerk: Largest of the commands [-], over its limit.
        beyond: By how much commands exceed limits: position [rad], velocity and acceleration as
            shares.
        robot_beyond: The same of the robot's joints: position [rad], velocity as a share of the
            URDF's.
    """

    commands: int
    tool_mm: FloatArray
    latency_ms: FloatArray
    jerk: float
    beyond: tuple[float, float, float]
    robot_beyond: tuple[float, float]


def score_teleop(bag_path: Path, robot: str = "g1", side: str = "left") -> TeleopScores:
    """Judge a run.

    Raises:
        InputError: If the bag holds no tele-operation.
    """
    arm = RobotArm(load_robot(robot, side))
    with open_bag(bag_path) as bag:
        found = [read_joint_motion(bag, topic) for topic in (TARGET, COMMAND, ROBOT)]
        trajectories = _first_points(bag)
    if any(each is None for each in found) or not len(trajectories):
        raise InputError(f"{bag_path} holds no tele-operation: the robot never followed")
    target, command, measured = (each for each in found if each is not None)
    limits = command_limits(arm, ArmParameters())
    position, velocity, acceleration = (trajectories[:, i] for i in range(3))
    moved = measured.position
    return TeleopScores(
        commands=len(command.stamps_ns),
        tool_mm=_tool_errors_mm(arm, target, measured),
        latency_ms=(command.recorded_ns - command.stamps_ns)[_is_new(command)] * 1e-6,
        jerk=_largest_jerk(command, acceleration) / float(limits.jerk.max()),
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


def _is_new(command: JointMotion) -> FloatArray:
    """Which commands answer a new capture: the others are the timer's."""
    return np.concatenate([[True], np.diff(command.stamps_ns) > 0])


def _first_points(bag: BagReader) -> FloatArray:
    """(n, 3, d): position, velocity, acceleration of every command."""
    points = []
    for message in bag.messages([TRAJECTORY]):
        first = bag.deserialize(message).points[0]
        points.append([first.positions, first.velocities, first.accelerations])
    return np.array(points, float)


def _largest_jerk(command: JointMotion, acceleration: FloatArray) -> float:
    """Of consecutive commands' accelerations [rad/s3], where they belong together."""
    count = min(len(acceleration), len(command.recorded_ns))
    step_s = np.diff(command.recorded_ns[:count]) * 1e-9
    together = (step_s > 0.005) & (step_s < 0.03)
    jerk = np.abs(np.diff(acceleration[:count], axis=0)).max(axis=1) / np.maximum(step_s, 0.005)
    return float(np.percentile(jerk[together], 99.0)) if together.any() else float("nan")


def _tool_errors_mm(arm: RobotArm, target: JointMotion, measured: JointMotion) -> FloatArray:
    """Distance of the robot's tool from that of the pose asked for, at each target's arrival."""
    errors = np.empty(len(target.stamps_ns))
    for row, when_ns in enumerate(target.recorded_ns):
        at = min(int(np.searchsorted(measured.recorded_ns, when_ns)), len(measured.position) - 1)
        places = []
        for q in (target.position[row], measured.position[at]):
            arm.update(q)
            places.append(arm.place(arm.file.tool)[0].copy())
        errors[row] = 1e3 * np.linalg.norm(places[0] - places[1])
    return errors
