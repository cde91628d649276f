"""Finds launch files and executables among the installed packages."""

from pathlib import Path

from ament_index_python.packages import get_packages_with_prefixes

from pose_core.errors import InputError
from pose_launch.errors import FileLine, LaunchError
from pose_node.child_process import executable

SUFFIXES = ("", ".launch.yaml", ".yaml")


def find_launch_file(name: str) -> Path:
    """A launch file by its path, or by its bare name in any package's ``launch`` folder.

    Raises:
        LaunchError: If there is none, or there are several.
    """
    path = Path(name)
    if path.is_file():
        return path.absolute()
    if path.name != name:
        raise LaunchError(None, f"found no launch file {name}")
    found = sorted(
        {
            candidate
            for package, prefix in get_packages_with_prefixes().items()
            for suffix in SUFFIXES
            if (
                candidate := Path(prefix) / "share" / package / "launch" / f"{name}{suffix}"
            ).is_file()
        }
    )
    if len(found) > 1:
        raise LaunchError(
            None, f"'{name}' is in several packages, give a path: {', '.join(map(str, found))}"
        )
    if not found:
        raise LaunchError(
            None, f"found no launch file '{name}', neither here nor in a package's launch folder"
        )
    return found[0]


def find_executable(package: str, name: str, place: FileLine) -> str:
    """Path of a package's executable, the one found by ``ros2 run``.

    Raises:
        LaunchError: If the package or the executable is missing.
    """
    try:
        return str(executable(package, name))
    except InputError as error:
        raise LaunchError(place, str(error)) from error
