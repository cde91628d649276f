"""The definitions of the messages that bags are read and written by."""

from pathlib import Path
from typing import Any

from ament_index_python.packages import PackageNotFoundError, get_package_share_directory
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from pose_common.errors import InputError

OWN_PACKAGES = ("pose_msgs",)


def make_typestore() -> Typestore:
    """The messages of ROS 2 Jazzy and, from the installed packages, our own."""
    typestore = get_typestore(Stores.ROS2_JAZZY)
    for package in OWN_PACKAGES:
        register_package(typestore, package)
    return typestore


def register_package(typestore: Typestore, package: str) -> None:
    """Add the messages of an installed package to a typestore.

    Raises:
        InputError: If the package is not installed, or holds no messages.
    """
    try:
        folder = Path(get_package_share_directory(package)) / "msg"
    except (PackageNotFoundError, ValueError) as error:
        raise InputError(
            f"package '{package}' is not installed: build and source it to use its messages"
        ) from error
    types: dict[str, Any] = {}
    for path in sorted(folder.glob("*.msg")):
        types.update(get_types_from_msg(path.read_text(), f"{package}/msg/{path.stem}"))
    if not types:
        raise InputError(f"package '{package}' has no messages in {folder}")
    typestore.register(
        {name: type_ for name, type_ in types.items() if name not in typestore.types}
    )
