"""A person whose arm is followed by a simulated robot, without ROS: streams in, what moved out."""

from dataclasses import dataclass, field

import numpy as np
from synthetic_body import body_offsets

from pose_core.api import BodyShape, load_body_model, make_urdf
from pose_teleop.arm_controller import ArmController
from pose_teleop.input_monitor import Now
from pose_teleop.parameters import ArmParameters
from pose_teleop.person_arm import angle_names
from pose_teleop.robot_dynamics import SimulatedArm
from pose_teleop.supervisor import State

PERIOD_NS = 10_000_000
START_NS = 10**18


def person_urdf(scale=1.0):
    model = load_body_model("default")
    return make_urdf(model, BodyShape(offsets=scale * body_offsets()), "subject")


def waving(t):
    """The arm's four angles [rad] at a time [s]: all of them move, none of them fast."""
    return np.array(
        [
            0.5 + 0.5 * np.sin(1.7 * t),
            0.4 + 0.3 * np.sin(2.3 * t),
            0.3 * np.sin(1.1 * t),
            1.0 + 0.6 * np.sin(2.9 * t),
        ]
    )


@dataclass
class Run:
    """What happened, a row a period."""

    state: list = field(default_factory=list)
    position: list = field(default_factory=list)
    velocity: list = field(default_factory=list)
    acceleration: list = field(default_factory=list)
    target: list = field(default_factory=list)
    robot: list = field(default_factory=list)
    tool: list = field(default_factory=list)
    wanted_tool: list = field(default_factory=list)


class Followed:
    """The person's stream, the controller, the robot, one period of 10 ms at a time."""

    def __init__(self, angles=waving, scale=1.0, **parameters):
        parameters = {"robot": "g1", "settle_time": 0.1, "ramp_time": 0.5, **parameters}
        parameters = {"soft_velocity": 2.0, **parameters}
        self.parameters = ArmParameters(**parameters)
        self.controller = ArmController(self.parameters)
        self.robot = SimulatedArm(self.controller.robot, mass_error=0.1, step_s=0.005)
        self.angles = angles
        self.names = angle_names(self.parameters.side)
        self.now_ns, self.ros_ahead_ns = 0, START_NS
        self.stddev, self.person, self.held = 0.02, "subject", True
        self.run = Run()
        self.controller.add_urdf(person_urdf(scale), self.now())

    def now(self):
        return Now(steady_ns=self.now_ns, ros_ns=self.now_ns + self.ros_ahead_ns)

    def hear(self, angles=None, rates=None, stamp_ns=None):
        t = self.now_ns * 1e-9
        angles = self.angles(t) if angles is None else angles
        rates = (self.angles(t + 1e-4) - self.angles(t - 1e-4)) / 2e-4 if rates is None else rates
        stamp_ns = self.now().ros_ns - 5_000_000 if stamp_ns is None else stamp_ns
        position, velocity = (dict(zip(self.names, each, strict=True)) for each in (angles, rates))
        stddev = dict.fromkeys(self.names, self.stddev)
        monitor = self.controller.monitor
        monitor.add_estimate(stamp_ns, self.person, position, stddev, self.now())
        monitor.add_joint_states(stamp_ns, position, velocity, self.now())

    def go(self, seconds, *, heard=True, robot_heard=True, hear=None):
        """Let time pass; the states that were visited, in order."""
        begin = len(self.run.state)
        for _ in range(round(seconds * 1e9 / PERIOD_NS)):
            self.now_ns += PERIOD_NS
            if heard:
                (hear or self.hear)()
            if robot_heard:
                self.controller.add_robot(self.robot.position, self.now())
            command = self.controller.step(self.now(), self.held)
            if command is not None:
                self.robot.command(
                    command.times_s,
                    np.array([m.position for m in command.motions]),
                    np.array([m.velocity for m in command.motions]),
                )
            self.robot.advance(PERIOD_NS * 1e-9)
            self._note()
        states = self.run.state[begin:]
        return [s for i, s in enumerate(states) if i == 0 or s is not states[i - 1]]

    def _note(self):
        run, motion = self.run, self.controller.limiter.motion
        run.state.append(self.controller.supervisor.state)
        run.position.append(motion.position)
        run.velocity.append(motion.velocity)
        run.acceleration.append(motion.acceleration)
        run.robot.append(self.robot.position)
        target = self.controller.target
        run.target.append(np.full(len(motion.position), np.nan) if target is None else target)

    def excess(self):
        """How far commands went beyond limits, over the limit: position, velocity, acceleration."""
        limits = self.controller.limiter.limits
        position = np.array(self.run.position)
        moving = np.array([s is not State.WAITING for s in self.run.state])
        outside = np.maximum(position - limits.upper, limits.lower - position)[moving].max()
        speed = (np.abs(self.run.velocity) / limits.velocity).max()
        force = (np.abs(self.run.acceleration) / limits.acceleration).max()
        return outside, speed - 1.0, force - 1.0

    def jerk_excess(self):
        """The same of the jerk between consecutive commands of the robot's motion."""
        limits = self.controller.limiter.limits
        jerk = np.diff(self.run.acceleration, axis=0) / (PERIOD_NS * 1e-9)
        same = [
            a is not State.WAITING and b is not State.WAITING
            for a, b in zip(self.run.state[:-1], self.run.state[1:], strict=True)
        ]
        return (np.abs(jerk[np.array(same)]) / limits.jerk).max() - 1.0
