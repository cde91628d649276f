"""Import of the library c3d, which only C3D files need: an extra of the package."""

from importlib import import_module
from typing import Any

from pose_core.errors import InputError


def c3d_library() -> Any:
    """Import the library.

    Raises:
        InputError: If it is not installed.
    """
    try:
        return import_module("c3d")
    except ModuleNotFoundError:
        raise InputError(
            "C3D files need the library c3d, which is not installed: pip install 'pose_io[c3d]'"
        ) from None
