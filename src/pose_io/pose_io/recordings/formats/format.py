"""Definition of a format: how it is recognised, and its reader."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from pose_io.recordings.recording import Recording


def _never(_path: Path, _begin: bytes) -> bool:
    return False


@dataclass(frozen=True, kw_only=True)
class Format:
    """One kind of file.

    Attributes:
        read: Reads a file of this kind.
        key_columns: For tables: columns of every file's header that no other format has.
        recognise: For other files: whether a file or folder is of this kind. Its arguments are the
            path and the beginning of the decompressed content, which is empty for a folder.
    """

    read: Callable[[Path], Recording]
    key_columns: frozenset[str] = frozenset()
    recognise: Callable[[Path, bytes], bool] = _never
