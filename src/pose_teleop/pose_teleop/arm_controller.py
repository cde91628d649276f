"""Controller of a robot's arm that follows a person's: mapping, limits and supervision."""

from dataclasses import dataclass

import numpy as np

from pose_core.api import FloatArray
from pose_core.joints import other_side
from pose_core.stamps import NS_PER_S
from pose_teleop.arm_mapping import ArmMapping, JointMapping, WristMapping
from pose_teleop.input_monitor import InputMonitor, Now
from pose_teleop.motion_limiter import (
    JERK_OF_ACCELERATION,
    MotionLimiter,
    MotionLimits,
    MotionState,
)
from pose_teleop.parameters import ArmParameters
from pose_teleop.robot_arm import RobotArm
from pose_teleop.robot_files import load_robot
from pose_teleop.supervisor import TO_PERSON, ArmFault, State, Supervisor

STOP_STEP_S = 0.02  # [s] between the points of the stopping trajectory
MAX_STEP_S = 0.03  # [s] upper bound of the command's time step, after pauses of the process


@dataclass(frozen=True, kw_only=True)
class ArmCommand:
    """Command to the robot's joints, with a stopping trajectory in case no further one arrives."""

    stamp_ns: int  # [ns] capture of the person's pose
    times_s: FloatArray  # (k,) [s] from now
    motions: tuple[MotionState, ...]  # (k,) the next one, then the stopping trajectory


class ArmController:
    """Algorithm of the node ``arm``, without ROS.

    Attributes:
        supervisor: State machine, with the state and the fault.
        monitor: Monitor of the person's data.
        limiter: Limiter of the command.

    Args:
        parameters: The node's parameters.

    Raises:
        PoseError: If the robot or a parameter is invalid.
    """

    def __init__(self, parameters: ArmParameters) -> None:
        self._parameters = p = parameters
        side = other_side(p.side) if p.mirror else p.side
        self.robot = RobotArm(load_robot(p.robot, side, p.urdf))
        limits = command_limits(self.robot, p)
        self.limiter = MotionLimiter(limits)
        self.monitor = InputMonitor(p)
        self.supervisor = Supervisor(p, full_velocity=float(limits.velocity.max()))
        self._mapping: ArmMapping | None = None
        if p.mode == "joints":
            self._mapping = JointMapping(self.robot)
        self._robot_position: tuple[int, FloatArray] | None = None
        self._before_ns: int | None = None
        self._target: tuple[FloatArray, FloatArray] | None = None

    def add_urdf(self, text: str, now: Now) -> None:
        """Set the person's kinematic tree (URDF)."""
        self.monitor.add_urdf(text, now)
        if self._parameters.mode == "wrist":
            assert self.monitor.arm is not None
            p = self._parameters
            self._mapping = WristMapping(self.robot, self.monitor.arm, p.mirror, p.scale)

    def add_robot(self, position: FloatArray, now: Now) -> None:
        """Set the robot's measured joint angles [rad], (n,)."""
        if np.isfinite(position).all():
            self._robot_position = now.steady_ns, np.asarray(position, float)

    def step(self, now: Now, is_held: bool) -> ArmCommand | None:
        """Update the state and compute the command; None while the robot is not commanded."""
        self._target = None
        fault = self._fault(now)
        self.monitor.count(fault if fault or is_held else ArmFault.NOT_HELD)
        state = self.supervisor.update(
            now_ns=now.steady_ns,
            fault=fault,
            is_held=is_held,
            is_at_rest=self.limiter.motion.is_at_rest,
            distance=self._distance,
        )
        since_s = (now.steady_ns - (self._before_ns or now.steady_ns)) / NS_PER_S
        self._before_ns = now.steady_ns
        if state is State.WAITING:
            self._begin_at_robot()
            return None
        period_s = min(max(since_s, 0.0), MAX_STEP_S)
        if state in TO_PERSON:
            target, rate = self._wanted()
            self.limiter.follow(target, rate, period_s, self.supervisor.fastest)
        else:
            self.limiter.brake(period_s)
        return self._command()

    @property
    def target(self) -> FloatArray | None:
        """Joint angles [rad], (n,), for the person's pose; None without a person."""
        return None if self._target is None else self._target[0]

    def _command(self) -> ArmCommand:
        """The current motion, and the stopping trajectory from it."""
        motions = [self.limiter.motion, *self.limiter.way_to_stop(STOP_STEP_S)]
        times_s = 1.0 / self._parameters.rate + STOP_STEP_S * np.arange(len(motions), dtype=float)
        return ArmCommand(stamp_ns=self.monitor.stamp_ns, times_s=times_s, motions=tuple(motions))

    def _fault(self, now: Now) -> ArmFault | None:
        if self._robot_position is None:
            return ArmFault.NO_ROBOT
        heard_ns, position = self._robot_position
        if now.steady_ns - heard_ns > self._parameters.max_age * NS_PER_S:
            return ArmFault.NO_ROBOT
        if self.supervisor.state is not State.WAITING:
            lag = np.abs(position - self.limiter.motion.position).max()
            if lag > self._parameters.max_lag:
                return ArmFault.LAGS
        return self.monitor.fault(now)

    def _begin_at_robot(self) -> None:
        if self._robot_position is not None:
            self.limiter.reset(self._robot_position[1])
        if self._mapping is not None:
            self._mapping.reset()

    def _wanted(self) -> tuple[FloatArray, FloatArray]:
        if self._target is None:
            assert self._mapping is not None
            angles, rates = self.monitor.angles, self.monitor.rates
            self._target = self._mapping.target_and_rate(angles, rates)
        return self._target

    def _distance(self) -> float:
        """Largest difference of a joint between the command and the person's pose [rad]."""
        target, _ = self._wanted()
        limits = self.limiter.limits
        inside = np.clip(target, limits.lower, limits.upper)
        return float(np.abs(inside - self.limiter.motion.position).max())


def command_limits(robot: RobotArm, p: ArmParameters) -> MotionLimits:
    """Limits of the commands."""
    count = len(robot.joints)
    acceleration = p.max_acceleration or robot.file.max_acceleration
    jerk = p.max_jerk or JERK_OF_ACCELERATION * acceleration
    return MotionLimits(
        lower=robot.lower + p.position_margin,
        upper=robot.upper - p.position_margin,
        velocity=p.velocity_share * robot.max_velocity,
        acceleration=np.full(count, acceleration),
        jerk=np.full(count, jerk),
    )
