"""``named_poses``: one person as named poses, as NVIDIA's teleoperation publishes it.

``NamedPoseArray`` has a header, ``name``, ``pose`` and ``is_valid`` (or ``names``, ``poses``), in
metres; full body with the joint names of SMPL.
"""

from typing import Any

import numpy as np

from kinect_bridge.parameters import KinectBridgeParameters
from kinect_bridge.source import SourceTopic
from kinect_bridge.sources.live import Person
from kinect_bridge.sources.topic_source import TopicSource
from pose_core.stamps import nanoseconds

PERSON = "0"
MAX_POSES = 256


class NamedPosesSource(TopicSource):
    """Source of one person as named poses."""

    NAME, TOPIC, JOINT_MAP = "named_poses", "xr_teleop/full_body", "smpl_24"
    TYPE = "teleop_ros2_interfaces/msg/NamedPoseArray"
    COUNTERS = ("messages_too_long", "messages_uneven", "poses_unknown")

    def __init__(self, parameters: KinectBridgeParameters) -> None:
        super().__init__(parameters)
        if parameters.message_type:
            self.topics = (SourceTopic(name=self.hardware_id, type_name=parameters.message_type),)

    def receive(self, message: Any, topic: str) -> None:
        """Process a message as one frame, without persons if it has no valid pose."""
        names = getattr(message, "name", None) or getattr(message, "names", [])
        poses = getattr(message, "pose", None) or getattr(message, "poses", [])
        is_valid = getattr(message, "is_valid", None) or [True] * len(names)
        if len(names) > MAX_POSES:
            self.counters.add("messages_too_long")
            return
        if not len(names) == len(poses) == len(is_valid):
            self.counters.add("messages_uneven")
            return
        positions = self.no_places()
        for name, pose, valid in zip(names, poses, is_valid, strict=True):
            joint = self.joint_map.index.get(name)
            if joint is None:
                self.counters.add("poses_unknown")
            elif valid:
                positions[joint] = pose.position.x, pose.position.y, pose.position.z
        seen = np.isfinite(positions).any()
        people = [Person(id=PERSON, positions=positions)] if seen else []
        self.push(people, nanoseconds(message.header.stamp) or None)
