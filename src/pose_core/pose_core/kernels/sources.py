"""The source files that determine the machine code of the kernels, and their hash.

As a program, ``python sources.py PACKAGE_FOLDER …`` prints the hash: so it imports nothing of ours.
"""

import hashlib
import re
import sys
from pathlib import Path

MARK = "@compiled"  # what a file with kernels holds
IMPORTED = re.compile(r"^from (pose_[\w.]+) import", re.MULTILINE)


def kernel_sources(*packages: Path) -> list[Path]:
    """The files of packages with kernels, and those from which they import.

    A kernel freezes the constants that it uses. A file that is imported for annotations only does
    not count if its import is indented, under ``if TYPE_CHECKING``.
    """
    texts = {path: path.read_text("utf-8") for each in packages for path in each.rglob("*.py")}
    marked = [path for path, text in texts.items() if MARK in text]
    names = {name for path in marked for name in IMPORTED.findall(texts[path])}
    imported = (
        package.parent / f"{name.replace('.', '/')}.py" for package in packages for name in names
    )
    return sorted({*marked, *(path for path in imported if path in texts)})


def sources_hash(*packages: Path) -> str:
    """Hash of the :func:`kernel_sources` of packages."""
    digest = hashlib.sha256()
    for path in kernel_sources(*packages):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:12]


if __name__ == "__main__":
    print(sources_hash(*map(Path, sys.argv[1:])))
