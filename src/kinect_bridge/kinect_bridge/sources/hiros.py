"""``hiros``: Hi-ROS' ``SkeletonGroup``, of one camera or merged.

A marker is a joint: ``id`` is its index in the joint map, or ``name`` its name; the position is
``center.pose.position`` [m] in the frame of the group.
"""

from typing import Any

import numpy as np

from kinect_bridge.parameters import KinectBridgeParameters
from kinect_bridge.sources.live import MAX_PEOPLE, LiveSource, Person
from kinect_bridge.sources.source import Topic
from pose_core.stamps import nanoseconds
from pose_io.recordings.joint_map_files import find_joint_map

MAX_MARKERS = 256  # of one skeleton


class HirosSource(LiveSource):
    """Source of Hi-ROS skeletons."""

    def __init__(self, parameters: KinectBridgeParameters) -> None:
        topic = parameters.topic or "skeleton_group"
        super().__init__(
            "hiros",
            topic,
            find_joint_map(parameters.joint_map or "hiros"),
            on_host_clock=True,
            counters=("messages_too_long", "markers_unknown"),
            topics=(
                Topic(
                    name=topic,
                    type_name="hiros_skeleton_msgs/msg/SkeletonGroup",
                    install="build the package hiros_skeleton_msgs and source its workspace",
                ),
            ),
        )

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
        positions = np.full((count, 3), np.nan)
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
