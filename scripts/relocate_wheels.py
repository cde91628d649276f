"""Bind the ROS wheels to this Python: correct their CMake files, print their library path.

The wheels' exported CMake files name the headers of the machine that built them.
"""

import re
import sys
import sysconfig
from pathlib import Path

import numpy

ABSOLUTE = r"/[^;\"\s]*?"


def relocate(text: str) -> str:
    """Replace any other machine's or environment's header folders with this interpreter's."""
    python, of_numpy = sysconfig.get_paths()["include"], numpy.get_include()
    text = re.sub(rf"(?<=[;\"\s]){ABSOLUTE}/include/python3\.\d+(?=[;\"\s])", python, text)
    return re.sub(rf"(?<=[;\"\s]){ABSOLUTE}/numpy/_core/include(?=[;\"\s])", of_numpy, text)


def main() -> None:
    """Correct every CMake file of the environment, then print the wheels' library path."""
    prefix = Path(sys.prefix)
    for path in prefix.glob("share/**/*.cmake"):
        text = path.read_text()
        if (mended := relocate(text)) != text:
            # A new file: this one may be a hard link into the installer's cache.
            new = path.with_name(path.name + ".new")
            new.write_text(mended)
            new.replace(path)
    site_packages = Path(sysconfig.get_paths()["platlib"])
    print(":".join([str(prefix / "lib"), *map(str, sorted(site_packages.glob("ros_*.libs")))]))


if __name__ == "__main__":
    main()
