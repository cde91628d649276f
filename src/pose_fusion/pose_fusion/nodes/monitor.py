"""The monitor node: prints the ``/diagnostics`` of all nodes, one JSON object in each line.

For programs that watch a graph without ROS; it ends when its reader closes the pipe.
"""

import json
import sys
import time
from dataclasses import asdict

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node

from pose_node.conversions import to_node_status
from pose_node.nodes.running import run_node


class MonitorNode(Node):
    """Subscribes to ``/diagnostics`` and prints each status."""

    def __init__(self) -> None:
        super().__init__("monitor")
        self.create_subscription(DiagnosticArray, "/diagnostics", self._on_diagnostics, 100)
        _print_line({"ready": True})

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            _print_line(asdict(to_node_status(status, time.time_ns())))


def _print_line(content: dict[str, object]) -> None:
    try:
        sys.stdout.write(json.dumps(content) + "\n")
        sys.stdout.flush()
    except BrokenPipeError:
        raise ExternalShutdownException from None


def main() -> None:
    """Run the node."""
    run_node(MonitorNode)


if __name__ == "__main__":
    main()
