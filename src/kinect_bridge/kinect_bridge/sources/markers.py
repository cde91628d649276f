"""``markers``: body tracking of the Azure Kinect's ROS driver, and of compatible wrappers.

``visualization_msgs/MarkerArray``, one marker per joint, ``id = 100 * body + joint``, metres in the
depth camera's optical frame. There is no confidence.
"""

from typing import Any

import numpy as np

from kinect_bridge.sources.live import MAX_PEOPLE, Person
from kinect_bridge.sources.topic_source import TopicSource
from pose_core.stamps import nanoseconds

IDS_PER_BODY = 100
ADD = 0  # visualization_msgs/Marker: also MODIFY
MAX_MARKERS = MAX_PEOPLE * IDS_PER_BODY


class MarkersSource(TopicSource):
    """Source of marker arrays."""

    NAME, TOPIC, JOINT_MAP = "markers", "body_tracking_data", "azure_kinect_ros"
    TYPE = "visualization_msgs/msg/MarkerArray"
    COUNTERS = ("messages_too_long", "markers_unknown", "markers_repeated")

    def receive(self, message: Any, topic: str) -> None:
        """Process a message as one frame."""
        if len(message.markers) > MAX_MARKERS:
            self.counters.add("messages_too_long")
            return
        count = len(self.joint_map.joints)
        bodies: dict[int, np.ndarray[Any, Any]] = {}
        stamp_ns = 0
        for marker in message.markers:
            body, joint = divmod(marker.id, IDS_PER_BODY)
            if marker.action != ADD or body < 0 or joint >= count:
                self.counters.add("markers_unknown")
                continue
            stamp_ns = max(stamp_ns, nanoseconds(marker.header.stamp))
            places = bodies.setdefault(body, self.no_places())
            position = marker.pose.position
            self.counters.add("markers_repeated", bool(np.isfinite(places[joint, 0])))
            places[joint] = position.x, position.y, position.z
        people = [Person(id=str(body), positions=places) for body, places in bodies.items()]
        self.push(people, stamp_ns or None)
