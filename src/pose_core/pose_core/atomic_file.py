"""Atomic writing of files; by default, only the owner can read them."""

import os
import secrets
from contextlib import suppress
from pathlib import Path

from pose_core.errors import InputError


def write_atomically(
    path: Path, content: bytes, what: str, *, mode: int = 0o600, is_synced: bool = True
) -> None:
    """Write a file; an existing one is replaced atomically.

    The data is on the disk before the file is renamed, so a power cut leaves the old file or the
    new one.

    Args:
        path: The file.
        content: Its content.
        what: What it contains, for error messages: "the calibration".
        mode: Its permissions, less those that the umask takes away.
        is_synced: Whether to wait until it is on the disk.

    Raises:
        InputError: If it cannot be written.
    """
    temporary = path.with_name(f".{path.name}.partial-{secrets.token_hex(4)}")
    try:
        handle = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode)
        with os.fdopen(handle, "wb") as file:
            file.write(content)
            file.flush()
            if is_synced:
                os.fsync(file.fileno())
        temporary.replace(path)
    except OSError as error:
        raise InputError(f"cannot write {what} {path}: {error.strerror}") from error
    finally:
        with suppress(OSError):  # it has its name
            temporary.unlink()
