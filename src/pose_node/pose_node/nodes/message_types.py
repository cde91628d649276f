"""Message classes by their names in bags and in the graph."""

import importlib
from typing import Any

from rclpy.type_support import check_for_type_support

from pose_core.errors import InputError


def message_class(msgtype: str) -> Any:
    """The class of a message type such as ``pose_msgs/msg/Skeleton``.

    Raises:
        InputError: If it is not a message type, or its package is not installed.
    """
    parts = msgtype.split("/")
    if len(parts) != 3 or parts[1] != "msg":
        raise InputError(f"{msgtype} is not a message type: expected PACKAGE/msg/NAME")
    try:
        found = getattr(importlib.import_module(f"{parts[0]}.msg"), parts[2])
        check_for_type_support(found)
    except (ImportError, AttributeError) as error:
        package = parts[0]
        raise InputError(
            f"the message type {msgtype} is not installed: install package '{package}'"
            f" (apt install ros-jazzy-{package.replace('_', '-')}), or build it, and source its"
            " workspace"
        ) from error
    return found
