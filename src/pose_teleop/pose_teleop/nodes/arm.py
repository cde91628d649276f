"""The node ``arm``: a robot's arm follows a person's within limits, and stops at faults."""

import time
from collections import deque
from functools import partial
from typing import Any

import numpy as np
from pose_msgs.msg import PoseEstimate
from rclpy.node import Node
from sensor_msgs.msg import JointState, Joy
from std_msgs.msg import Bool, String
from trajectory_msgs.msg import JointTrajectory

from pose_core.counters import Counters
from pose_core.errors import InputError
from pose_core.stamps import NS_PER_S, nanoseconds
from pose_node.node_status import Level, Report
from pose_node.nodes.declaring import declare_parameters
from pose_node.nodes.diagnostics import DiagnosticsPublisher
from pose_node.nodes.running import run_node
from pose_node.nodes.steady_timer import steady_timer
from pose_teleop.arm_controller import ArmCommand, ArmController
from pose_teleop.conversions import by_name, robot_states, to_robot_position, to_trajectory
from pose_teleop.input_monitor import Now
from pose_teleop.nodes.bodies import LATCHED, NEWEST, body_topic
from pose_teleop.parameters import ArmParameters
from pose_teleop.supervisor import TO_PERSON, State

LATE_SHARE = 1.5  # [periods] without joint states after which the timer computes a step


class DeadManInput:
    """Subscribes to the dead-man input selected by the parameters.

    Args:
        node: The node that subscribes.
        parameters: The node's parameters.
    """

    def __init__(self, node: Node, parameters: ArmParameters) -> None:
        self._kind, self._button = parameters.dead_man, parameters.joy_button
        self._timeout_ns = round(parameters.dead_man_timeout * NS_PER_S)
        self._pressed_ns: int | None = None
        if self._kind == "joy":
            node.create_subscription(Joy, "joy", self._on_joy, NEWEST)
        elif self._kind == "heartbeat":
            node.create_subscription(Bool, "dead_man", self._on_heartbeat, NEWEST)

    @property
    def is_held(self) -> bool:
        """Whether the input is held; always True without an input."""
        if self._kind == "none":
            return True
        heard = self._pressed_ns
        return heard is not None and time.monotonic_ns() - heard < self._timeout_ns

    def _on_joy(self, message: Joy) -> None:
        is_pressed = list(message.buttons[self._button : self._button + 1]) == [1]
        self._on_heartbeat(Bool(data=is_pressed))

    def _on_heartbeat(self, message: Bool) -> None:
        self._pressed_ns = time.monotonic_ns() if message.data else None


class ArmNode(Node):
    """Steps an :class:`ArmController` at each joint states message, or by a timer without them.

    Args:
        **options: As for ``rclpy.node.Node``.

    Raises:
        PoseError: If the robot or a parameter is invalid.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__("arm", **options)
        parameters = declare_parameters(self, ArmParameters)
        self.controller = ArmController(parameters)
        self._counters = Counters("commands", "malformed_urdf", "malformed_robot_states")
        self._latencies_ms: deque[float] = deque(maxlen=500)
        self._late_ns = round(LATE_SHARE * NS_PER_S / parameters.rate)
        self._stepped_ns = 0
        self._said: tuple[State, object] | None = None
        self._trajectories = self.create_publisher(JointTrajectory, "arm/joint_trajectory", 10)
        self._display = self.create_publisher(JointState, "arm/command", 10)
        self._target = self.create_publisher(JointState, "arm/target", 10)
        self._dead_man = DeadManInput(self, parameters)
        topic = partial(body_topic, parameters.subject)
        self.create_subscription(String, topic("urdf"), self._on_urdf, LATCHED)
        self.create_subscription(PoseEstimate, topic("estimate"), self._on_estimate, NEWEST)
        self.create_subscription(JointState, topic("joint_states"), self._on_states, NEWEST)
        self.create_subscription(JointState, "arm/joint_states", self._on_robot, NEWEST)
        steady_timer(self, 1.0 / parameters.rate, self._on_timer)
        self._diagnostics = DiagnosticsPublisher(self, self._report)

    def _now(self) -> Now:
        ros_ns = self.get_clock().now().nanoseconds
        return Now(steady_ns=time.monotonic_ns(), ros_ns=ros_ns)

    def _on_urdf(self, message: String) -> None:
        try:
            self.controller.add_urdf(message.data, self._now())
        except InputError as error:
            self._counters.add("malformed_urdf")
            self.get_logger().warning(str(error), throttle_duration_sec=5.0)

    def _on_estimate(self, message: PoseEstimate) -> None:
        position = by_name(message, message.position)
        stddev = by_name(message, message.position_stddev)
        stamp_ns, now = nanoseconds(message.header.stamp), self._now()
        self.controller.monitor.add_estimate(stamp_ns, message.id, position, stddev, now)

    def _on_states(self, message: JointState) -> None:
        now = self._now()
        stamp_ns = nanoseconds(message.header.stamp)
        position = by_name(message, message.position)
        velocity = by_name(message, message.velocity)
        self.controller.monitor.add_joint_states(stamp_ns, position, velocity, now)
        self._step(now)
        if self.controller.supervisor.state in TO_PERSON:
            self._latencies_ms.append((self._now().ros_ns - stamp_ns) * 1e-6)

    def _on_robot(self, message: JointState) -> None:
        position = to_robot_position(message, self.controller.robot.joints)
        if position is None:
            self._counters.add("malformed_robot_states")
        else:
            self.controller.add_robot(position, self._now())

    def _on_timer(self) -> None:
        now = self._now()
        if now.steady_ns - self._stepped_ns > self._late_ns:
            self._step(now)

    def _step(self, now: Now) -> None:
        self._stepped_ns = now.steady_ns
        command = self.controller.step(now, self._dead_man.is_held)
        if command is not None:
            self._publish(command, now.ros_ns)
        supervisor = self.controller.supervisor
        said = (supervisor.state, supervisor.fault)
        if said != self._said:
            self._said = said
            self.get_logger().info(self._sentence())
            self._diagnostics.publish()

    def _publish(self, command: ArmCommand, now_ns: int) -> None:
        self._counters.add("commands")
        joints = self.controller.robot.joints
        self._trajectories.publish(to_trajectory(command, joints, now_ns))
        now, target = command.motions[0], self.controller.target
        self._display.publish(robot_states(joints, command.stamp_ns, now.position, now.velocity))
        if target is not None:
            self._target.publish(robot_states(joints, command.stamp_ns, target))

    def _sentence(self) -> str:
        supervisor = self.controller.supervisor
        reason = "" if supervisor.fault is None else f": {supervisor.fault.value}"
        if supervisor.latched is not None:
            reason += "; release the dead-man input"
        return f"{supervisor.state.value}{reason}"

    def _report(self) -> Report:
        controller = self.controller
        moves = controller.supervisor.state in TO_PERSON
        fault = controller.supervisor.fault
        median, p99 = np.nan, np.nan
        if self._latencies_ms:
            median, p99 = np.percentile(self._latencies_ms, [50.0, 99.0])
        return Report(
            level=Level.OK if moves else Level.WARN,
            message=self._sentence(),
            values={
                "state": controller.supervisor.state.name.lower(),
                "reason": "none" if fault is None else fault.name.lower(),
                "robot": controller.robot.file.name,
                "hand_deviation_m": f"{controller.monitor.deviation_m:.3f}",
                "latency_ms": f"{median:.1f}",
                "latency_p99_ms": f"{p99:.1f}",
                **self._counters.as_dict(),
                **controller.limiter.counters.as_dict(),
                **controller.monitor.counters.as_dict("input/"),
            },
        )


def main() -> None:
    """Run the node."""
    run_node(ArmNode, parameters=ArmParameters)
