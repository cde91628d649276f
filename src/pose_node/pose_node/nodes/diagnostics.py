"""A node's state in ``/diagnostics``, once a second."""

from collections.abc import Callable

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.node import Node

from pose_node.node_status import Report
from pose_node.nodes.steady_timer import steady_timer

PERIOD_S = 1.0


class DiagnosticsPublisher:
    """Publishes what ``report`` returns, under the node's fully qualified name."""

    def __init__(self, node: Node, report: Callable[[], Report]) -> None:
        self._node = node
        self._report = report
        self.hardware_id = ""  # the device, if there is one
        self._publisher = node.create_publisher(DiagnosticArray, "/diagnostics", 10)
        self._timer = steady_timer(node, PERIOD_S, self.publish)

    def publish(self) -> None:
        """Publish the state immediately."""
        report = self._report()
        status = DiagnosticStatus(
            level=bytes([report.level]),
            name=self._node.get_fully_qualified_name(),
            message=report.message,
            hardware_id=self.hardware_id,
            values=[KeyValue(key=key, value=str(value)) for key, value in report.values.items()],
        )
        message = DiagnosticArray(status=[status])
        message.header.stamp = self._node.get_clock().now().to_msg()
        self._publisher.publish(message)
