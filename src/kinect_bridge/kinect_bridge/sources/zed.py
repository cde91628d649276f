"""``zed``: body tracking of Stereolabs' ROS 2 wrapper, ``zed_msgs/ObjectsStamped``.

``label_id`` is the person, ``body_format`` gives the number of valid keypoints of the 70, and newer
wrappers give ``skeleton_keypoint_confidence``. Metres in the wrapper's camera frame (x forward,
y left, z up).
"""

from typing import Any

import numpy as np

from kinect_bridge.parameters import KinectBridgeParameters
from kinect_bridge.sources.live import MAX_PEOPLE, Person
from kinect_bridge.sources.topic_source import TopicSource
from pose_core.joints import TrackingState
from pose_core.stamps import nanoseconds
from pose_io.recordings.joint_map_files import shipped_joint_map

MAPS = {0: "zed_18", 1: "zed_34", 2: "zed_38"}  # by body_format
TRACKED, SEARCHING = 1, 2  # tracking_state of a person: measured, or predicted


class ZedSource(TopicSource):
    """Source of the ZED wrapper's objects."""

    NAME, TOPIC, JOINT_MAP = "zed", "zed/zed_node/body_trk/skeletons", "zed_38"
    TYPE = "zed_msgs/msg/ObjectsStamped"
    COUNTERS = ("messages_too_long", "objects_without_skeleton", "objects_unknown_format")

    def __init__(self, parameters: KinectBridgeParameters) -> None:
        super().__init__(parameters)
        self._has_own_map = bool(parameters.joint_map)

    def receive(self, message: Any, topic: str) -> None:
        """Process a message as one frame; all its objects have the same body format."""
        if len(message.objects) > 4 * MAX_PEOPLE:
            self.counters.add("messages_too_long")
            return
        people = []
        for each in message.objects:
            if not each.skeleton_available or each.tracking_state not in (TRACKED, SEARCHING):
                self.counters.add("objects_without_skeleton")
            elif not self._has_own_map and each.body_format not in MAPS:
                self.counters.add("objects_unknown_format")
            else:
                if not self._has_own_map:
                    self.joint_map = shipped_joint_map(MAPS[each.body_format])
                people.append(self._person(each))
        self.push(people, nanoseconds(message.header.stamp) or None)

    def _person(self, each: Any) -> Person:
        count = len(self.joint_map.joints)
        keypoints = each.skeleton_3d.keypoints[:count]
        confidence = getattr(each, "skeleton_keypoint_confidence", None)
        return Person(
            id=str(each.label_id),
            positions=np.array([keypoint.kp for keypoint in keypoints], dtype=np.float64),
            confidence=None if confidence is None else np.array(confidence[:count], np.float64),
            at_most=(
                TrackingState.TRACKED if each.tracking_state == TRACKED else TrackingState.INFERRED
            ),
        )
