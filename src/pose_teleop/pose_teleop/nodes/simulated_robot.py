"""The node ``simulated_robot``: a simulated arm with a joint trajectory controller's interface."""

import time
from typing import Any

from rclpy.node import Node
from sensor_msgs.msg import JointState
from tf2_msgs.msg import TFMessage
from trajectory_msgs.msg import JointTrajectory
from visualization_msgs.msg import MarkerArray

from pose_core.counters import Counters
from pose_core.stamps import NS_PER_S
from pose_node.conversions import to_header, to_transform
from pose_node.node_status import Level, Report
from pose_node.nodes.declaring import declare_parameters
from pose_node.nodes.diagnostics import DiagnosticsPublisher
from pose_node.nodes.running import run_node
from pose_node.nodes.steady_timer import steady_timer
from pose_teleop.conversions import robot_states, to_points, to_robot_markers
from pose_teleop.nodes.bodies import LATCHED, NEWEST
from pose_teleop.parameters import SimulatedRobotParameters
from pose_teleop.robot_arm import RobotArm
from pose_teleop.robot_dynamics import STEP_S, SimulatedArm
from pose_teleop.robot_files import load_robot
from pose_teleop.robot_meshes import link_meshes

DRAWN_S = 0.04  # [s] between transforms of its links
CELL_M = 0.012  # [m] resolution of its meshes
ROOT = "robot"  # its root frame, and the prefix of its links' frames
MAX_DURATION_S = 0.1  # [s] longest pause of the process that is simulated afterwards


class SimulatedRobot(Node):
    """Steps a :class:`SimulatedArm`.

    Args:
        **options: As for ``rclpy.node.Node``.

    Raises:
        PoseError: If the robot or a parameter is invalid.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__("simulated_robot", **options)
        parameters = declare_parameters(self, SimulatedRobotParameters)
        self.arm = RobotArm(load_robot(parameters.robot, parameters.side, parameters.urdf))
        self.simulated = SimulatedArm(self.arm, parameters.mass_error)
        mount = self.arm.mount_quaternion(parameters.yaw)
        self._place = (parameters.x, parameters.y, parameters.z, *mount)
        self._counters = Counters("commands", "malformed_commands")
        self._stepped_ns = self._drawn_ns = time.monotonic_ns()
        self._states = self.create_publisher(JointState, "arm/joint_states", 10)
        self._tf = self.create_publisher(TFMessage, "tf", 10)
        self._shape = self.create_publisher(MarkerArray, "arm/markers", LATCHED)
        self._shape.publish(to_robot_markers(link_meshes(self.arm, CELL_M), ROOT))
        self.create_subscription(JointTrajectory, "arm/joint_trajectory", self._on_command, NEWEST)
        steady_timer(self, 1.0 / parameters.rate, self._step)
        self._diagnostics = DiagnosticsPublisher(self, self._report)

    def _on_command(self, message: JointTrajectory) -> None:
        points = to_points(message, self.arm.joints)
        if points is None:
            self._counters.add("malformed_commands")
            return
        self._counters.add("commands")
        self._advance()
        self.simulated.command(*points)

    def _advance(self) -> None:
        now_ns = time.monotonic_ns()
        since_s = (now_ns - self._stepped_ns) / NS_PER_S
        if since_s >= STEP_S:
            steps = int(since_s / STEP_S)
            self.simulated.advance(min(steps * STEP_S, MAX_DURATION_S))
            self._stepped_ns += round(steps * STEP_S * NS_PER_S)

    def _step(self) -> None:
        self._advance()
        stamp_ns = int(self.get_clock().now().nanoseconds)
        robot = self.simulated
        states = robot_states(self.arm.joints, stamp_ns, robot.position, robot.velocity)
        self._states.publish(states)
        now_ns = time.monotonic_ns()
        if now_ns - self._drawn_ns > DRAWN_S * NS_PER_S:
            self._drawn_ns = now_ns
            root = to_transform(to_header(stamp_ns, "map"), ROOT, self._place)
            in_root = to_header(stamp_ns, ROOT)
            links = (
                to_transform(in_root, f"{ROOT}/{name}", place)
                for name, place in self.arm.links(robot.position).items()
            )
            self._tf.publish(TFMessage(transforms=[root, *links]))

    def _report(self) -> Report:
        message = f"simulating {self.arm.file.name}"
        return Report(level=Level.OK, message=message, values=self._counters.as_dict())


def main() -> None:
    """Run the node."""
    run_node(SimulatedRobot, parameters=SimulatedRobotParameters)
