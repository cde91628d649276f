"""The probe: records when each joint state arrived, and the fusion's own latency by stage.

Prints one JSON object when it is stopped: ``arrived`` maps the stamp of each joint state [ns] to
its arrival [ns], ``stages`` the name of a stage to the text of the fusion's last ``/diagnostics``.
"""

import json
import sys
import time

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.node import Node
from sensor_msgs.msg import JointState

from pose_core.stamps import serialized_ns
from pose_fusion.watching.stages import STAGE
from pose_io.names import BODIES
from pose_node.nodes.running import run_node


class LatencyProbe(Node):
    """Subscribes to the joint states and to the diagnostics."""

    def __init__(self) -> None:
        super().__init__("latency_probe")
        self._arrived: dict[int, int] = {}
        self._stages: dict[str, str] = {}
        topic = f"{BODIES}subject/joint_states"
        self.create_subscription(JointState, topic, self._on_joint_state, 100, raw=True)
        self.create_subscription(DiagnosticArray, "/diagnostics", self._on_diagnostics, 100)

    def _on_joint_state(self, data: bytes) -> None:
        self._arrived[serialized_ns(data)] = time.time_ns()

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            for pair in status.values:
                if pair.key.startswith(STAGE):
                    self._stages[pair.key.removeprefix(STAGE)] = pair.value

    def destroy_node(self) -> None:
        """Print what has been recorded."""
        json.dump({"arrived": self._arrived, "stages": self._stages}, sys.stdout)
        sys.stdout.flush()
        super().destroy_node()


def main() -> None:
    """Run the node."""
    run_node(LatencyProbe)


if __name__ == "__main__":
    main()
