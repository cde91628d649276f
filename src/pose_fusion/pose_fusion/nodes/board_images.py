"""Live images for the calibration with a board."""

from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import partial
from typing import Any

from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import CameraInfo, CompressedImage, Image

from pose_calibration.board.camera import Camera, camera_from_info
from pose_calibration.board.collecting import BoardCollector
from pose_calibration.board.images import grey_from_message
from pose_core.errors import InputError
from pose_core.stamps import nanoseconds
from pose_node.nodes.running import node_of_tool, spin_until


class BoardImagesNode(Node):
    """Feeds a :class:`BoardCollector` from image topics, compressed or not.

    Args:
        collector: Collects the views of the board.
        topics: Image topic by camera; ``<topic>/compressed`` is subscribed to as well.
        info_topics: CameraInfo topic by camera.
    """

    def __init__(
        self,
        collector: BoardCollector,
        topics: Mapping[str, str],
        info_topics: Mapping[str, str],
        **options: Any,
    ) -> None:
        super().__init__("board_calibration", **options)
        self._collector = collector
        self.cameras: dict[str, Camera] = {}
        self.malformed = ""  # why the last unusable message was rejected
        for camera, topic in topics.items():
            for message_type, name, receive in (
                (Image, topic, self._on_image),
                (CompressedImage, f"{topic}/compressed", self._on_image),
                (CameraInfo, info_topics[camera], self._on_info),
            ):
                callback = partial(self._receive, receive, camera)
                self.create_subscription(message_type, name, callback, qos_profile_sensor_data)

    def _receive(self, receive: Callable[[str, Any], None], camera: str, message: Any) -> None:
        try:
            receive(camera, message)
        except InputError as error:
            self.malformed = f"'{camera}': {error}"

    def _on_image(self, camera: str, message: Any) -> None:
        stamp_ns = nanoseconds(message.header.stamp)
        self._collector.add(camera, stamp_ns, grey_from_message(message))

    def _on_info(self, camera: str, message: CameraInfo) -> None:
        self.cameras[camera] = camera_from_info(message)


def collect_live(
    collector: BoardCollector,
    topics: Mapping[str, str],
    info_topics: Mapping[str, str],
    on_progress: Callable[[str], None],
) -> dict[str, Camera]:
    """Watch image topics until the collector has enough, or the user stops it.

    Args:
        collector: Collects the views of the board.
        topics: Image topic by camera.
        info_topics: CameraInfo topic by camera.
        on_progress: Called periodically with what is wrong or missing.

    Returns:
        The intrinsics published by the cameras.
    """
    cameras: dict[str, Camera] = {}
    make = partial(BoardImagesNode, collector, topics, info_topics)
    # After an interruption, the collected views may suffice.
    with suppress(KeyboardInterrupt), node_of_tool(make) as (node, executor):
        cameras = node.cameras
        spin_until(
            executor, lambda: not collector.missing, on_progress=lambda: on_progress(node.malformed)
        )
    return cameras
