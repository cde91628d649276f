"""The probe: notes when frames were published and when the joint states of their instants arrived.

Prints one JSON object when it is stopped: ``published`` and ``arrived``, stamp [ns] to time [ns].
"""

import json
import struct
import sys
import time
from typing import Any

from pose_msgs.msg import SkeletonArray
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import JointState

from pose_common.nodes.running import run_node

NS_PER_S = 1_000_000_000
STAMP = struct.Struct("<4xiI")  # after the encapsulation


class LatencyProbe(Node):
    """Subscribes to two Kinects and to the joint states."""

    def __init__(self) -> None:
        super().__init__("latency_probe")
        self._published: dict[int, int] = {}
        self._arrived: dict[int, int] = {}
        for sensor in ("left", "right"):
            topic = f"kinect_{sensor}/skeletons"
            self.create_subscription(
                SkeletonArray, topic, self._on_frame, qos_profile_sensor_data, raw=True
            )
        topic = "/humans/bodies/subject/joint_states"
        self.create_subscription(JointState, topic, self._on_joint_state, 100, raw=True)

    def _on_frame(self, data: bytes, info: dict[str, Any]) -> None:
        self._published[_stamp_ns(data)] = info["source_timestamp"]

    def _on_joint_state(self, data: bytes, info: dict[str, Any]) -> None:
        # The middleware's own note of the arrival is from before this process woke.
        self._arrived[_stamp_ns(data)] = max(time.time_ns(), info["received_timestamp"])

    def destroy_node(self) -> None:
        """Say what has been noted."""
        json.dump({"published": self._published, "arrived": self._arrived}, sys.stdout)
        sys.stdout.flush()
        super().destroy_node()


def _stamp_ns(data: bytes) -> int:
    seconds, nanoseconds = STAMP.unpack_from(data)
    return int(seconds) * NS_PER_S + int(nanoseconds)


def main() -> None:
    """Run the node."""
    run_node(LatencyProbe)


if __name__ == "__main__":
    main()
