"""The node ``hri``: publishes the person by REP 155, for the tools of ROS4HRI."""

from functools import partial
from typing import Any

import numpy as np
from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage

from pose_core.counters import Counters
from pose_core.stamps import NS_PER_S, nanoseconds
from pose_node.conversions import to_header
from pose_node.node_status import Level, Report
from pose_node.nodes.declaring import declare_parameters
from pose_node.nodes.diagnostics import DiagnosticsPublisher
from pose_node.nodes.message_types import message_class
from pose_node.nodes.running import run_node
from pose_node.nodes.steady_timer import steady_timer
from pose_teleop.human_model import HumanAngles, human_urdf, joint_offsets
from pose_teleop.nodes.bodies import LATCHED, NEWEST, body_topic
from pose_teleop.parameters import HriParameters

CHECK_S = 0.1  # [s] between checks whether the person is tracked


class HriNode(Node):
    """Publishes joint states, tree, root frame and the list of tracked bodies.

    Args:
        **options: As for ``rclpy.node.Node``.

    Raises:
        PoseError: If hri_msgs is not installed, or a parameter is invalid.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__("hri", **options)
        self._settings = parameters = declare_parameters(self, HriParameters)
        self._ids = message_class(parameters.ids_type)
        self._angles = HumanAngles()
        self._counters = Counters("joint_states", "incomplete", "not_finite", "malformed_urdf")
        self._unusable = ""  # what is wrong with the last joint states
        self._heard_ns: int | None = None
        ours, theirs = (partial(body_topic, b) for b in (parameters.subject, parameters.id))
        self._states = self.create_publisher(JointState, theirs("joint_states"), 10)
        self._urdf = self.create_publisher(String, theirs("urdf"), LATCHED)
        self._tf = self.create_publisher(TFMessage, "tf", 10)
        self._tracked = self.create_publisher(self._ids, "humans/bodies/tracked", LATCHED)
        self._announced: tuple[str, ...] | None = None
        self.create_subscription(JointState, ours("joint_states"), self._on_states, NEWEST)
        self.create_subscription(String, ours("urdf"), self._on_urdf, LATCHED)
        self.create_subscription(TFMessage, "tf", self._on_tf, 20)
        steady_timer(self, CHECK_S, self._announce)
        self._diagnostics = DiagnosticsPublisher(self, self._report)

    def _on_states(self, message: JointState) -> None:
        angles = dict(zip(message.name, message.position, strict=False))
        if not np.isfinite(list(angles.values())).all():
            self._refuse("not_finite", "are not finite")
            return
        try:
            found = self._angles.convert(angles)
        except KeyError as error:
            self._refuse("incomplete", f"lack a position of {error}")
            return
        self._unusable = ""
        self._counters.add("joint_states")
        self._heard_ns = int(self.get_clock().now().nanoseconds)
        body = self._settings.id
        header = to_header(nanoseconds(message.header.stamp), f"body_{body}")
        names = [f"{name}_{body}" for name in found]
        self._states.publish(JointState(header=header, name=names, position=list(found.values())))
        self._announce()

    def _refuse(self, counter: str, why: str) -> None:
        self._counters.add(counter)
        self._unusable = f": the joint states {why}"

    def _on_urdf(self, message: String) -> None:
        try:
            offsets = joint_offsets(message.data, self._settings.subject)
        except (KeyError, ValueError, SyntaxError) as error:
            self._counters.add("malformed_urdf")
            self.get_logger().warning(f"the person's urdf is not the fusion's: {error!r}")
            return
        self._urdf.publish(String(data=human_urdf(offsets, self._settings.id)))

    def _on_tf(self, message: TFMessage) -> None:
        """Publish the root frame under the model's name; robot_state_publisher adds the others."""
        transforms = message.transforms
        if transforms and transforms[0].child_frame_id == f"body_{self._settings.subject}":
            root = transforms[0]
            root.child_frame_id = f"body_{self._settings.id}"
            self._tf.publish(TFMessage(transforms=[root]))

    def _announce(self) -> None:
        """Publish the list of tracked bodies when it changes."""
        now_ns = int(self.get_clock().now().nanoseconds)
        heard = self._heard_ns
        is_there = heard is not None and now_ns - heard < self._settings.timeout * NS_PER_S
        tracked = (self._settings.id,) if is_there else ()
        if tracked != self._announced:
            self._announced = tracked
            self._tracked.publish(self._ids(header=to_header(now_ns), ids=list(tracked)))

    def _report(self) -> Report:
        tracked = bool(self._announced)
        level = Level.OK if tracked and not self._unusable else Level.WARN
        who = f"body {self._settings.id}" if tracked else "nobody"
        message = f"{who} is tracked{self._unusable}"
        return Report(level=level, message=message, values=self._counters.as_dict())


def main() -> None:
    """Run the node."""
    run_node(HriNode, parameters=HriParameters)
