"""``markers``: body tracking of the Azure Kinect's ROS driver, and of compatible wrappers.

``visualization_msgs/MarkerArray``, one marker per joint, ``id = 100 * body + joint``, metres in the
depth camera's optical frame. There is no confidence.
"""

from typing import Any

import numpy as np

from kinect_bridge.parameters import KinectBridgeParameters
from kinect_bridge.sources.live import MAX_PEOPLE, LiveSource, Person
from kinect_bridge.sources.source import Topic
from pose_core.stamps import nanoseconds
from pose_io.recordings.joint_map_files import find_joint_map

IDS_PER_BODY = 100
ADD = 0  # visualization_msgs/Marker: also MODIFY
MAX_MARKERS = MAX_PEOPLE * IDS_PER_BODY


class MarkersSource(LiveSource):
    """Source of marker arrays."""

    def __init__(self, parameters: KinectBridgeParameters) -> None:
        topic = parameters.topic or "body_tracking_data"
        super().__init__(
            "markers",
            topic,
            find_joint_map(parameters.joint_map or "azure_kinect_ros"),
            on_host_clock=True,
            counters=("messages_too_long", "markers_unknown", "markers_repeated"),
            topics=(Topic(name=topic, type_name="visualization_msgs/msg/MarkerArray"),),
        )

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
            places = bodies.setdefault(body, np.full((count, 3), np.nan))
            position = marker.pose.position
            self.counters.add("markers_repeated", bool(np.isfinite(places[joint, 0])))
            places[joint] = position.x, position.y, position.z
        people = [Person(id=str(body), positions=places) for body, places in bodies.items()]
        self.push(people, stamp_ns or None)
