"""The probe: records when each joint state arrived in another process.

Prints one JSON object when it is stopped: the arrival [ns] by the stamp of each joint state [ns].
"""

import json
import sys
import time

from rclpy.node import Node
from sensor_msgs.msg import JointState

from pose_core.stamps import serialized_ns
from pose_io.names import BODIES
from pose_node.nodes.running import run_node


class LatencyProbe(Node):
    """Subscribes to the joint states."""

    def __init__(self) -> None:
        super().__init__("latency_probe")
        self._arrived: dict[int, int] = {}
        topic = f"{BODIES}subject/joint_states"
        self.create_subscription(JointState, topic, self._on_joint_state, 100, raw=True)

    def _on_joint_state(self, data: bytes) -> None:
        self._arrived[serialized_ns(data)] = time.time_ns()

    def destroy_node(self) -> None:
        """Print what has been recorded."""
        json.dump(self._arrived, sys.stdout)
        sys.stdout.flush()
        super().destroy_node()


def main() -> None:
    """Run the node."""
    run_node(LatencyProbe)


if __name__ == "__main__":
    main()
