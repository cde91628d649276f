"""What a format is: the columns it is known by, and its reader."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from pose_io.recordings.recording import Recording


@dataclass(frozen=True, kw_only=True)
class Format:
    """One kind of file."""

    key_columns: frozenset[str]  # in every file's header, and in no other format's; none: no header
    read: Callable[[Path], Recording]
