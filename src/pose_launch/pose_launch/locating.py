"""Finds launch files among the installed packages."""

from pathlib import Path

from ament_index_python.packages import get_packages_with_prefixes

from pose_core.errors import InputError

SUFFIXES = ("", ".launch.yaml", ".yaml")


def find_launch_file(name: str) -> Path:
    """A launch file by its path, or by its bare name in any package's ``launch`` folder.

    Raises:
        InputError: If there is none, or there are several.
    """
    path = Path(name)
    if path.is_file():
        return path.absolute()
    if path.name != name:
        raise InputError(f"found no launch file {name}")
    packages = get_packages_with_prefixes().items()
    folders = {Path(prefix) / "share" / package / "launch" for package, prefix in packages}
    candidates = (folder / f"{name}{suffix}" for folder in folders for suffix in SUFFIXES)
    found = sorted(filter(Path.is_file, candidates))
    if len(found) > 1:
        raise InputError(
            f"'{name}' is in several packages, give a path: {', '.join(map(str, found))}"
        )
    if not found:
        raise InputError(
            f"found no launch file '{name}', neither here nor in a package's launch folder"
        )
    return found[0]
