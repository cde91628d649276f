"""What a format is: what it is known by, and its reader."""

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
        key_columns: Of a table: in every file's header, and in no other format's.
        recognise: Of anything else: whether a file, or a folder, is of this kind; it is given the
            path and the content's beginning, decompressed, which is empty for a folder.
    """

    read: Callable[[Path], Recording]
    key_columns: frozenset[str] = frozenset()
    recognise: Callable[[Path, bytes], bool] = _never
