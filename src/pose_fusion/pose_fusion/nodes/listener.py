"""A node that only subscribes: topics of the graph, rates, latencies, diagnostics."""

import time
from collections import deque
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from operator import attrgetter
from typing import Any

import numpy as np
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from pose_msgs.msg import PoseEstimate, Skeleton, SkeletonArray
from rclpy.node import Node
from rclpy.serialization import deserialize_message
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage

from pose_core.counters import Counters
from pose_core.errors import InputError
from pose_core.stamps import serialized_ns
from pose_fusion.nodes import qos
from pose_fusion.watching.observation import GraphSnapshot, TopicWatch, TrackingWatch
from pose_io.names import SKELETON_ARRAY, TF_STATIC
from pose_io.skeleton_messages import skeleton_sample, skeleton_samples
from pose_io.static_transforms import StaticTransforms
from pose_io.topics import BODY_TOPIC, IMU_TOPIC, SENSOR_TOPIC
from pose_node.conversions import to_node_status
from pose_node.node_status import NodeStatus
from pose_node.nodes.message_types import message_class
from pose_node.nodes.running import node_of_tool, spin_until

DISCOVERY_S = 0.3  # [s] between searches for new topics
DEPTH = 200  # [messages]
OTHERS = ("/tf", TF_STATIC, "/diagnostics", "/extrinsics")  # in any namespace
PATTERNS = (SENSOR_TOPIC, IMU_TOPIC, BODY_TOPIC)
LATENCIES = 1000  # number of stored latencies
PROBE = "~/probe"


class GraphListener(Node):
    """Subscribes to all our topics that appear, and collects statistics."""

    def __init__(self, name: str, **options: Any) -> None:
        super().__init__(name, **options)
        self.counters = Counters("malformed_messages", "unknown_types")
        self._watches: dict[str, TopicWatch] = {}
        self._tracking: dict[str, TrackingWatch] = {}
        self._statuses: dict[str, NodeStatus] = {}
        self._static_transforms = StaticTransforms()
        self._placed: tuple[str, ...] = ()  # sensors
        self._latencies: deque[float] = deque(maxlen=LATENCIES)
        self._hears_itself = False
        self._probe = self.create_publisher(String, PROBE, 10)
        self.create_subscription(String, PROBE, self._on_probe, 10)
        self.create_timer(DISCOVERY_S, self._discover)
        self._discover()

    def snapshot(self) -> GraphSnapshot:
        """The present state of the graph."""
        now_ns = time.time_ns()
        topics = [watch.status(now_ns) for _, watch in sorted(self._watches.items())]
        latency_s = None
        if self._latencies:
            median_s, p99_s = np.percentile(self._latencies, [50, 99]).tolist()
            latency_s = median_s, p99_s
        return GraphSnapshot(
            topics=tuple(replace(t, publishers=self.count_publishers(t.name)) for t in topics),
            nodes=self._other_nodes(),
            statuses=tuple(sorted(self._statuses.values(), key=attrgetter("name"))),
            tracked={name: watch.share(now_ns) for name, watch in sorted(self._tracking.items())},
            placed_sensors=self._placed,
            fusion_latency_s=latency_s,
            hears_itself=self._hears_itself,
        )

    # -- subscriptions --------------------------------------------------------------------------

    def _discover(self) -> None:
        self._probe.publish(String(data="are you there?"))
        for topic, types in self.get_topic_names_and_types():
            if topic in self._watches or not _is_ours(topic):
                continue
            offered = [info.qos_profile for info in self.get_publishers_info_by_topic(topic)]
            if not offered:
                continue
            self._watches[topic] = TopicWatch(topic)
            try:
                kind = message_class(types[0])
            except InputError:
                self.counters.add("unknown_types")
                continue
            profile = qos.for_subscription(offered, DEPTH)
            callback = partial(self._on_message, topic, kind, self._reader_of(topic, types[0]))
            self.create_subscription(kind, topic, callback, profile, raw=True)

    def _reader_of(self, topic: str, msgtype: str) -> Callable[[str, Any], None] | None:
        """The function that reads a topic's messages, if there is one."""
        readers: dict[str, Callable[[str, Any], None]] = {
            SKELETON_ARRAY: self._on_skeletons,
            "pose_msgs/msg/Skeleton": self._on_skeleton,
            "pose_msgs/msg/PoseEstimate": self._on_estimate,
            "diagnostic_msgs/msg/DiagnosticArray": self._on_diagnostics,
        }
        if topic.endswith(TF_STATIC):
            readers["tf2_msgs/msg/TFMessage"] = self._on_tf_static
        return readers.get(msgtype)

    def _on_message(
        self, topic: str, kind: Any, read: Callable[[str, Any], None] | None, data: bytes
    ) -> None:
        now_ns = time.time_ns()
        has_header = "header" in kind.get_fields_and_field_types()
        self._watches[topic].add(now_ns, serialized_ns(data) if has_header else None)
        if read is None:
            return
        try:
            read(topic, deserialize_message(data, kind))
        except InputError:
            self.counters.add("malformed_messages")

    def _on_skeletons(self, topic: str, message: SkeletonArray) -> None:
        for sample in skeleton_samples(message, "")[:1]:
            self._track(topic, sample.tracking_state)

    def _on_skeleton(self, topic: str, message: Skeleton) -> None:
        self._track(topic, skeleton_sample(message, "").tracking_state)

    def _track(self, topic: str, tracking_state: Any) -> None:
        self._tracking.setdefault(topic, TrackingWatch()).add(time.time_ns(), tracking_state)

    def _on_estimate(self, _topic: str, message: PoseEstimate) -> None:
        self._latencies.append(message.latency)

    def _on_diagnostics(self, _topic: str, message: DiagnosticArray) -> None:
        for status in message.status:
            self._statuses[status.name] = to_node_status(status, time.time_ns())

    def _on_tf_static(self, _topic: str, message: TFMessage) -> None:
        self._placed = tuple(self._static_transforms.add(message))

    def _on_probe(self, _message: String) -> None:
        self._hears_itself = True

    # -- what is there --------------------------------------------------------------------------

    def _other_nodes(self) -> tuple[str, ...]:
        own = self.get_fully_qualified_name()
        nodes = self.get_node_names_and_namespaces()
        names = {f"{namespace.rstrip('/')}/{name}" for name, namespace in nodes if name[:1] != "_"}
        return tuple(sorted(names - {own}))


def listen(duration_s: float) -> GraphSnapshot:
    """Listen to the graph for a while, with a separate node."""
    with node_of_tool(lambda: GraphListener("doctor")) as (node, executor):
        spin_until(executor, lambda: not rclpy.ok(), duration_s)
        return node.snapshot()


def _is_ours(topic: str) -> bool:
    return topic.endswith(OTHERS) or any(pattern.search(topic) for pattern in PATTERNS)
