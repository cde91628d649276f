"""Base of the sources that subscribe to topics."""

from typing import ClassVar

from kinect_bridge.parameters import KinectBridgeParameters
from kinect_bridge.source import SourceTopic
from kinect_bridge.sources.live import LiveSource
from pose_io.recordings.joint_map_files import find_joint_map


class TopicSource(LiveSource):
    """Source of messages of one topic; a subclass names the defaults."""

    TOPIC: ClassVar[str]
    TYPE: ClassVar[str]  # package/msg/Type
    JOINT_MAP: ClassVar[str]

    def __init__(self, parameters: KinectBridgeParameters) -> None:
        joint_map = find_joint_map(parameters.joint_map or self.JOINT_MAP)
        super().__init__(parameters.topic or self.TOPIC, joint_map, on_host_clock=True)
        self.topics = (SourceTopic(name=self.hardware_id, type_name=self.TYPE),)
