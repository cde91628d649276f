"""Message definitions for reading and writing bags, without ROS."""

import os
from pathlib import Path
from typing import Any

from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from pose_core.errors import InputError

DEFINITIONS = Path(__file__).parent / "definitions"  # one folder per package
INSTALLED = "AMENT_PREFIX_PATH"  # environment variable: install prefixes of ROS packages


def make_typestore() -> Typestore:
    """A typestore with the messages of ROS 2 Jazzy and pose_msgs."""
    typestore = get_typestore(Stores.ROS2_JAZZY)
    for folder in sorted(DEFINITIONS.iterdir()):
        _register_folder(typestore, folder.name, folder)
    return typestore


def register_package(typestore: Typestore, package: str) -> None:
    """Add the messages of a package that is installed with ROS to a typestore.

    Raises:
        InputError: If the package is not installed, or contains no messages.
    """
    for prefix in filter(None, os.environ.get(INSTALLED, "").split(os.pathsep)):
        share = Path(prefix) / "share" / package
        if share.is_dir():
            _register_folder(typestore, package, share / "msg")
            return
    raise InputError(
        f"package '{package}' is not installed: build and source it to use its messages"
    )


def _register_folder(typestore: Typestore, package: str, folder: Path) -> None:
    types: dict[str, Any] = {}
    for path in sorted(folder.glob("*.msg")):
        types.update(get_types_from_msg(path.read_text(), f"{package}/msg/{path.stem}"))
    if not types:
        raise InputError(f"package '{package}' has no messages in {folder}")
    typestore.register(
        {name: type_ for name, type_ in types.items() if name not in typestore.types}
    )
