"""Definition of a format: how it is recognised, and its reader."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from pose_io.recordings.recording import Recording


@dataclass(frozen=True, kw_only=True)
class Format:
    """One kind of file."""

    read: Callable[[Path], Recording]
    """Reads a file; raises an InputError if it is missing or not of this kind."""
    key_columns: frozenset[str] = frozenset()
    """For tables: columns of every file's header that no other format has."""
    recognise: Callable[[Path, bytes], bool] = lambda _path, _begin: False
    """For other files: whether a file or folder is of this kind, by its path and the beginning of
    the decompressed content, which is empty for a folder."""
