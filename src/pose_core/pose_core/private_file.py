"""Atomic writing of files with personal data, readable only by the owner."""

import os
import tempfile
from pathlib import Path

from pose_core.errors import InputError


def write_private(path: Path, text: str, what: str, *, is_synced: bool = True) -> None:
    """Write a file of mode 0600, whatever the umask; an existing one is replaced atomically.

    The data is on the disk before the file is renamed, so a power cut leaves the old file or the
    new one.

    Args:
        path: The file.
        text: Its content.
        what: What it contains, for error messages: "the calibration".
        is_synced: Whether to wait until it is on the disk.

    Raises:
        InputError: If it cannot be written.
    """
    temporary = ""
    try:
        handle, temporary = tempfile.mkstemp(prefix=f".{path.name}.partial-", dir=path.parent)
        with os.fdopen(handle, "w", encoding="utf-8") as file:
            file.write(text)
            file.flush()
            if is_synced:
                os.fsync(file.fileno())
        os.replace(temporary, path)
    except OSError as error:
        if temporary:
            Path(temporary).unlink(missing_ok=True)
        raise InputError(f"cannot write {what} {path}: {error.strerror}") from error
