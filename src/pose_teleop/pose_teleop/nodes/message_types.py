"""Message classes by their names, found when the node runs."""

from importlib import import_module
from typing import Any

from pose_core.errors import InputError


def message_class(name: str) -> Any:
    """The class of ``package/msg/Type``.

    Raises:
        InputError: If it names no message, or its package is not installed.
    """
    package, kind, message = (*name.split("/"), "", "")[:3]
    if kind != "msg" or not message:
        raise InputError(f"'{name}' names no message: expected for example 'hri_msgs/msg/IdsList'")
    try:
        return getattr(import_module(f"{package}.msg"), message)
    except (ImportError, AttributeError):
        raise InputError(
            f"the message type {name} is not installed: install package '{package}'"
            f" (apt install ros-jazzy-{package.replace('_', '-')}), or build it, and source its"
            " workspace"
        ) from None
