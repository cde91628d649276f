"""Base of the sources that subscribe to topics."""

from typing import ClassVar

from kinect_bridge.parameters import KinectBridgeParameters
from kinect_bridge.source import SourceTopic
from kinect_bridge.sources.live import LiveSource
from pose_io.recordings.joint_map_files import find_joint_map


class TopicSource(LiveSource):
    """Source of messages of one topic; a subclass names the defaults."""

    NAME: ClassVar[str]  # in messages
    TOPIC: ClassVar[str]
    TYPE: ClassVar[str]  # package/msg/Type
    JOINT_MAP: ClassVar[str]
    COUNTERS: ClassVar[tuple[str, ...]]

    def __init__(self, parameters: KinectBridgeParameters) -> None:
        topic = parameters.topic or self.TOPIC
        super().__init__(
            self.NAME,
            topic,
            find_joint_map(parameters.joint_map or self.JOINT_MAP),
            on_host_clock=True,
            counters=self.COUNTERS,
            topics=(SourceTopic(name=topic, type_name=self.TYPE),),
        )
