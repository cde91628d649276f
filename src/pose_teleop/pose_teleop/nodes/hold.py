"""The node ``hold``: holds the dead-man input while it runs; for simulations."""

from typing import Any

from rclpy.node import Node
from std_msgs.msg import Bool

from pose_node.nodes.declaring import declare_parameters
from pose_node.nodes.running import run_node
from pose_node.nodes.steady_timer import steady_timer
from pose_teleop.parameters import HoldParameters


class HoldNode(Node):
    """Publishes a heartbeat.

    Args:
        **options: As for ``rclpy.node.Node``.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__("hold", **options)
        parameters = declare_parameters(self, HoldParameters)
        self._publisher = self.create_publisher(Bool, "dead_man", 1)
        steady_timer(self, 1.0 / parameters.rate, lambda: self._publisher.publish(Bool(data=True)))


def main() -> None:
    """Run the node."""
    run_node(HoldNode, parameters=HoldParameters)
