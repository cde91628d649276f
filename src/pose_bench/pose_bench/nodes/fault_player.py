"""The node that replays sensors with faults, and records the graph's output."""

import threading
import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from pose_msgs.msg import Skeleton
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import JointState

from pose_bench.faults.judging import Heard, Poses
from pose_bench.faults.messages import Planned
from pose_core.stamps import NS_PER_S, nanoseconds
from pose_io.names import BODIES, TF_STATIC
from pose_node.conversions import to_node_status
from pose_node.node_status import NodeStatus
from pose_node.nodes.message_types import message_class
from pose_node.nodes.qos import latched, reliable, sensor_data

BODY = f"{BODIES}subject"
SENSOR_QOS, RELIABLE_QOS = sensor_data(100), reliable(1000)


class FaultPlayer(Node):
    """Publishes serialised messages at their times; subscribes to the output and diagnostics."""

    def __init__(self) -> None:
        rclpy.init(args=[])
        super().__init__("fault_player")
        self._publishers_by_topic: dict[str, Any] = {}
        self._joints: list[tuple[int, bytes]] = []
        self._skeletons: list[tuple[int, bytes]] = []
        self._said: list[NodeStatus] = []
        self._executor = SingleThreadedExecutor()
        self.latest_s = 0.0  # [s] largest delay of a publication
        for kind, name, noted in (
            (JointState, "joint_states", self._joints),
            (Skeleton, "skeleton", self._skeletons),
        ):
            self.create_subscription(kind, f"{BODY}/{name}", _noting(noted), RELIABLE_QOS, raw=True)
        self.create_subscription(DiagnosticArray, "/diagnostics", self._on_said, RELIABLE_QOS)
        self._executor.add_node(self)
        self._thread = threading.Thread(target=self._executor.spin, daemon=True)
        self._thread.start()

    def _on_said(self, message: DiagnosticArray) -> None:
        for status in message.status:
            self._said.append(to_node_status(status, time.time_ns()))

    def has_said(self, node: str) -> bool:
        """Whether a node has sent a report."""
        return any(said.name == node for said in self._said)

    def open(self, plan: Sequence[Planned]) -> None:
        """Create the publishers for a plan."""
        for _, topic, kind, _ in plan:
            if topic not in self._publishers_by_topic:
                profile = SENSOR_QOS
                if topic in (TF_STATIC, "/clock_offsets"):
                    profile = latched(10)
                elif topic == "/diagnostics":
                    profile = reliable(100)
                self._publishers_by_topic[topic] = self.create_publisher(
                    message_class(kind), topic, profile
                )

    def play(
        self,
        plan: Sequence[Planned],
        acts: Sequence[tuple[float, Callable[[], None]]],
        start_ns: int,
        until_s: float,
    ) -> None:
        """Publish all messages and run all actions at their times."""
        publishers = self._publishers_by_topic
        begin = time.monotonic() + (start_ns - time.time_ns()) / NS_PER_S
        todo: list[tuple[float, Callable[[], None]]] = sorted(
            [*acts, *((at, partial(publishers[topic].publish, d)) for at, topic, _, d in plan)],
            key=lambda each: each[0],
        )
        for at_s, do in todo:
            if at_s > until_s:
                break
            wait_s = begin + at_s - time.monotonic()
            if wait_s > 0.0005:
                time.sleep(wait_s)
            else:
                self.latest_s = max(self.latest_s, -wait_s)
            do()
        time.sleep(max(0.0, begin + until_s - time.monotonic()))

    def heard(self) -> Heard:
        """All received messages."""
        joints = [(at, deserialize_message(data, JointState)) for at, data in list(self._joints)]
        bodies = [(at, deserialize_message(data, Skeleton)) for at, data in list(self._skeletons)]
        return Heard(
            joints=_poses(joints, [message.position for _, message in joints]),
            bodies=_poses(bodies, [[(p.x, p.y, p.z) for p in m.position] for _, m in bodies]),
            said=list(self._said),
        )

    def close(self) -> None:
        """Destroy the node."""
        self._executor.shutdown()
        self._thread.join(timeout=2.0)
        self.destroy_node()
        rclpy.try_shutdown()


def _noting(noted: list[tuple[int, bytes]]) -> Callable[[bytes], None]:
    return lambda data: noted.append((time.time_ns(), data))


def _poses(messages: Sequence[tuple[int, Any]], values: Sequence[Any]) -> Poses:
    return Poses(
        stamps_ns=np.array([nanoseconds(m.header.stamp) for _, m in messages], np.int64),
        arrived_ns=np.array([at for at, _ in messages], np.int64),
        values=np.array(values, float),
    )
