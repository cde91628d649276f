"""``hiros``: Hi-ROS' ``SkeletonGroup``, of one camera or merged.

A marker is a joint: ``id`` is its index in the joint map, or ``name`` its name; the position is
``center.pose.position`` [m] in the frame of the group.
"""

from typing import Any

import numpy as np

from kinect_bridge.sources.live import MAX_PEOPLE, Person
from kinect_bridge.sources.topic_source import TopicSource
from pose_core.stamps import nanoseconds

MAX_MARKERS = 256  # of one skeleton


class HirosSource(TopicSource):
    """Source of Hi-ROS skeletons."""

    NAME, TOPIC, JOINT_MAP = "hiros", "skeleton_group", "hiros"
    TYPE = "hiros_skeleton_msgs/msg/SkeletonGroup"
    COUNTERS = ("messages_too_long", "markers_unknown")

    def receive(self, message: Any, topic: str) -> None:
        """Process a message as one frame; its stamp is that of the camera's data."""
        skeletons = message.skeletons
        if len(skeletons) > MAX_PEOPLE or any(len(s.markers) > MAX_MARKERS for s in skeletons):
            self.counters.add("messages_too_long")
            return
        stamps = [nanoseconds(skeleton.src_time) for skeleton in skeletons]
        stamp_ns = max(stamps, default=0) or nanoseconds(message.header.stamp)
        self.push([self._person(skeleton) for skeleton in skeletons], stamp_ns or None)

    def _person(self, skeleton: Any) -> Person:
        count = len(self.joint_map.joints)
        positions = self.no_places()
        confidence = np.full(count, np.nan)
        for marker in skeleton.markers:
            joint = self.joint_map.index.get(marker.name, marker.id)
            if not 0 <= joint < count:
                self.counters.add("markers_unknown")
                continue
            place = marker.center.pose.position
            positions[joint] = place.x, place.y, place.z
            confidence[joint] = marker.confidence
        return Person(id=str(skeleton.id), positions=positions, confidence=confidence)
