"""Import of the optional requirements of tele-operation, with instructions in the error."""

import os
import sys
from importlib import import_module
from pathlib import Path
from typing import Any

from pose_core.errors import InputError

INSTALL = "run './pose build --teleop', or 'pip install -r requirements.txt' in src/pose_teleop"
_DISTRIBUTIONS = {"pinocchio": "pin", "ruckig": "ruckig"}


def require(module: str) -> Any:
    """Import a module of an optional requirement.

    Raises:
        InputError: If it is not installed; the message has the command to install it.
    """
    try:
        return import_module(module)
    except ImportError as error:
        name = _DISTRIBUTIONS.get(module, module)
        raise InputError(
            f"tele-operation needs the Python package '{name}', which cannot be imported"
            f" ({error}): {INSTALL}"
        ) from error


def share_folders() -> list[Path]:
    """Folders of robot packages: prefixes of ROS, of Python, and of pinocchio's wheels."""
    prefixes = os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep) + [sys.prefix]
    prefixes += [str(Path(entry) / "cmeel.prefix") for entry in sys.path if entry]
    folders = (Path(prefix) / "share" for prefix in prefixes if prefix)
    return [folder for folder in folders if folder.is_dir()]


def in_package(path: str) -> Path:
    """The file of a ``package://NAME/PATH`` address, or a plain path.

    Raises:
        InputError: If there is no such file.
    """
    if not path.startswith("package://"):
        found = Path(path).expanduser()
        if not found.is_file():
            raise InputError(f"found no robot description {found}: give the path of a URDF file")
        return found
    name, _, rest = path.removeprefix("package://").partition("/")
    for folder in share_folders():
        if (folder / name / rest).is_file():
            return folder / name / rest
    raise InputError(f"found no {rest} of the package '{name}': {INSTALL}")
