"""Bind the ROS wheels to this Python: mend their CMake files, print their library path.

The wheels' exported CMake files name the headers of the machine that built them.
"""

import re
import sys
import sysconfig
from pathlib import Path

import numpy

BUILD_MACHINE = r"/opt/python/[^;\"\s]*?"


def relocate(text: str) -> str:
    """Replace the build machine's header folders with this interpreter's."""
    text = re.sub(BUILD_MACHINE + r"/include/python3\.\d+", sysconfig.get_paths()["include"], text)
    return re.sub(BUILD_MACHINE + r"/numpy/_core/include", numpy.get_include(), text)


def main() -> None:
    """Mend every CMake file of the environment, then print the wheels' library path."""
    prefix = Path(sys.prefix)
    for path in prefix.glob("share/**/*.cmake"):
        text = path.read_text()
        if (mended := relocate(text)) != text:
            path.write_text(mended)
    site_packages = Path(sysconfig.get_paths()["platlib"])
    print(":".join([str(prefix / "lib"), *map(str, sorted(site_packages.glob("ros_*.libs")))]))


if __name__ == "__main__":
    main()
