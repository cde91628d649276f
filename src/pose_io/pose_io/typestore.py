"""Message definitions for reading and writing bags, without ROS."""

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from pose_core.errors import InputError

DEFINITIONS = Path(__file__).parent / "definitions"  # one folder per package
INSTALLED = "AMENT_PREFIX_PATH"  # environment variable: install prefixes of ROS packages


def make_typestore() -> Typestore:
    """A typestore with the messages of ROS 2 Jazzy and pose_msgs."""
    typestore = get_typestore(Stores.ROS2_JAZZY)
    for folder in sorted(DEFINITIONS.iterdir()):
        types = _defined_by(folder, folder.name)
        typestore.register({k: v for k, v in types.items() if k not in typestore.types})
    return typestore


def require_type(typestore: Typestore, msgtype: str) -> None:
    """Add a message type to a typestore, and those that it consists of.

    Args:
        typestore: What is not in it is looked up among the packages that are installed with ROS.
        msgtype: For example ``nav_msgs/msg/Odometry``.

    Raises:
        InputError: If a package is not installed, or does not define the type.
    """
    open_types = [msgtype]
    while open_types:
        needed = open_types.pop()
        if needed in typestore.types:
            continue
        package = needed.split("/")[0]
        types = _defined_by(_message_folder(package), package)
        if needed not in types:
            raise InputError(f"package '{package}' does not define the message type '{needed}'")
        new = {name: type_ for name, type_ in types.items() if name not in typestore.types}
        typestore.register(new)
        for _, fields in new.values():
            open_types += message_types(fields)


def message_types(fields: Any) -> Iterator[str]:
    """The message types of a definition's fields, those of arrays included."""
    for _, (kind, content) in fields:
        while kind in (Nodetype.ARRAY, Nodetype.SEQUENCE):
            kind, content = content[0]
        if kind == Nodetype.NAME:
            yield content


def _message_folder(package: str) -> Path:
    for prefix in filter(None, os.environ.get(INSTALLED, "").split(os.pathsep)):
        share = Path(prefix) / "share" / package
        if share.is_dir():
            return share / "msg"
    raise InputError(
        f"package '{package}' is not installed: build and source it to use its messages"
    )


def _defined_by(folder: Path, package: str) -> dict[str, Any]:
    """A package's message types: constants and fields by name, as rosbags describes them."""
    types: dict[str, Any] = {}
    for path in sorted(folder.glob("*.msg")):
        types.update(get_types_from_msg(path.read_text(), f"{package}/msg/{path.stem}"))
    return types
