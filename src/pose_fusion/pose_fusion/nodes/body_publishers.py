"""Publishers of each person's estimates and kinematic tree."""

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from rclpy.node import Node
from rclpy.publisher import Publisher
from std_msgs.msg import String

from pose_core.api import BodyModel, BodyShape, EstimateBlock, make_urdf
from pose_core.stamps import NS_PER_S
from pose_fusion.conversions import body_topics, urdf_topic
from pose_fusion.estimate_bytes import EstimateBytes
from pose_io.typestore import make_typestore
from pose_node.nodes.qos import latched

QUEUE = 10  # [messages] of each topic


@dataclass
class _Body:
    publishers: dict[str, Publisher]  # by topic
    to_bytes: EstimateBytes
    shape: BodyShape | None = None  # the last published one


class BodyPublishers:
    """Publishes under ``humans/bodies/<id>/`` in the node's namespace; creates topics on demand.

    Args:
        node: The node that publishes.
        model: The body model.
        example: Estimates to warm up the conversion to messages.
    """

    def __init__(self, node: Node, model: BodyModel, example: EstimateBlock) -> None:
        self._node = node
        self._model = model
        self._example = example
        self._typestore = make_typestore()
        self._bodies: dict[str, _Body] = {}

    def open(self, body_id: str) -> None:
        """Create a person's publishers, if they do not exist yet."""
        if body_id not in self._bodies:
            to_bytes = EstimateBytes(self._model, body_id, self._typestore, self._example[0])
            for _ in to_bytes.write(self._example, np.zeros(len(self._example))):
                pass
            profiles = {topic: (each, QUEUE) for topic, each in body_topics(body_id).items()}
            profiles[urdf_topic(body_id)] = String, latched(1)
            publishers = {
                # Relative names, so that a namespace applies to the whole graph.
                topic: self._node.create_publisher(each, topic.lstrip("/"), profile)
                for topic, (each, profile) in profiles.items()
            }
            self._bodies[body_id] = _Body(publishers, to_bytes)

    def publish(self, body_id: str, estimates: EstimateBlock) -> float:
        """Publish a person's estimates; returns the latency of the newest [s]."""
        self.open(body_id)
        body = self._bodies[body_id]
        now_ns = self._node.get_clock().now().nanoseconds
        # Clocks are corrected to within some milliseconds: a stamp may be later than now.
        latencies_s = np.maximum(now_ns - estimates.newest_ns, 0) / NS_PER_S
        for topic, rows in body.to_bytes.write(estimates, latencies_s):
            for data in rows:
                body.publishers[topic].publish(data.tobytes())
        return float(latencies_s[-1])

    def publish_shape(self, body_id: str, shape: BodyShape) -> bool:
        """Publish a person's kinematic tree if the shape has changed; returns whether it has."""
        self.open(body_id)
        body = self._bodies[body_id]
        if shape is body.shape:
            return False
        body.shape = shape
        urdf = String(data=make_urdf(self._model, shape, body_id))
        body.publishers[urdf_topic(body_id)].publish(urdf)
        return True

    def keep(self, body_ids: Collection[str]) -> None:
        """Destroy the publishers of everybody else."""
        for body_id in self._bodies.keys() - body_ids:
            for publisher in self._bodies.pop(body_id).publishers.values():
                self._node.destroy_publisher(publisher)
