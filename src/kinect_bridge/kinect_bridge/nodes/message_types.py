"""Message types by their name, found when the node runs."""

import re
from importlib import import_module
from typing import Any

from kinect_bridge.sources.source import Topic
from pose_core.errors import InputError

TYPE_NAME = r"([a-z][a-z0-9_]*)/msg/([A-Za-z][A-Za-z0-9]*)"


def message_type(topic: Topic) -> Any:
    """The class of a topic's messages.

    Raises:
        InputError: If its package is not installed.
    """
    match = re.fullmatch(TYPE_NAME, topic.type_name)
    if match is None:
        raise InputError(
            f"'{topic.type_name}' names no message: expected for example "
            "'visualization_msgs/msg/MarkerArray'"
        )
    package, name = match.groups()
    try:
        return getattr(import_module(f"{package}.msg"), name)
    except (ImportError, AttributeError):
        how = topic.install or "install the package and source its workspace"
        raise InputError(
            f"topic '{topic.name}' carries {topic.type_name}, which is not installed: {how}"
        ) from None
