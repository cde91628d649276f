"""The probe: notes when frames were published and when the joint states of their instants arrived.

Prints one JSON object when it is stopped: ``published/<sensor>`` and ``arrived``, each of which
gives a time [ns] for a stamp [ns], and ``late``: at a stamp, how many frames the fusion had used
until then whose instants had been told already.
"""

import json
import sys
import time
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from pose_msgs.msg import SkeletonArray
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import JointState

from pose_core.stamps import nanoseconds, serialized_ns
from pose_node.nodes.running import run_node

LATE = "frames_late_but_used"


class LatencyProbe(Node):
    """Subscribes to two Kinects and to the joint states."""

    def __init__(self) -> None:
        super().__init__("latency_probe")
        self._noted: dict[str, dict[int, int]] = {"arrived": {}, "late": {}}
        for sensor in ("left", "right"):
            topic = f"kinect_{sensor}/skeletons"
            times = self._noted[f"published/{sensor}"] = {}

            def on_frame(data: bytes, info: dict[str, Any], times: dict[int, int] = times) -> None:
                times[serialized_ns(data)] = info["source_timestamp"]

            self.create_subscription(
                SkeletonArray, topic, on_frame, qos_profile_sensor_data, raw=True
            )
        topic = "/humans/bodies/subject/joint_states"
        self.create_subscription(JointState, topic, self._on_joint_state, 100, raw=True)
        self.create_subscription(DiagnosticArray, "/diagnostics", self._on_diagnostics, 100)

    def _on_joint_state(self, data: bytes, info: dict[str, Any]) -> None:
        # The middleware's own note of the arrival is from before this process woke.
        self._noted["arrived"][serialized_ns(data)] = max(
            time.time_ns(), info["received_timestamp"]
        )

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            for pair in status.values:
                if pair.key == LATE:
                    self._noted["late"][nanoseconds(message.header.stamp)] = int(pair.value)

    def destroy_node(self) -> None:
        """Say what has been noted."""
        json.dump(self._noted, sys.stdout)
        sys.stdout.flush()
        super().destroy_node()


def main() -> None:
    """Run the node."""
    run_node(LatencyProbe)


if __name__ == "__main__":
    main()
