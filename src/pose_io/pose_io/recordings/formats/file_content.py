"""Reading a file's content, decompressed if it is gzip, up to a limit."""

import gzip
import zlib
from pathlib import Path

from pose_core.errors import InputError

GZIP_MAGIC = b"\x1f\x8b"
MAX_BYTES = 512 * 1024 * 1024  # [bytes] decompressed: hours of skeletons
MAX_TABLE_BYTES = 256 * 1024 * 1024  # [bytes] decompressed: three hours of two cameras


def read_content(path: Path, limit: int = MAX_BYTES) -> bytes:
    """Read a whole file.

    Raises:
        InputError: If it is missing, damaged or longer than the limit.
    """
    data = _read(path, limit + 1)
    if len(data) > limit:
        raise InputError(f"{path} has more than {limit // 1024**2} MB: split the recording")
    return data


def read_beginning(path: Path, count: int) -> bytes:
    """Read the first bytes of a file; empty for a folder.

    Raises:
        InputError: If it is missing or damaged.
    """
    return b"" if path.is_dir() else _read(path, count)


def _read(path: Path, count: int) -> bytes:
    try:
        with path.open("rb") as file:
            if file.peek(2)[:2] != GZIP_MAGIC:
                return file.read(count)
            with gzip.GzipFile(fileobj=file) as unzipped:
                return unzipped.read(count)
    except FileNotFoundError:
        raise InputError(f"found no file {path}: give the path of a recording") from None
    except EOFError:
        raise InputError(f"{path} is cut short (gzip): copy it again") from None
    except (gzip.BadGzipFile, zlib.error) as error:
        raise InputError(f"{path} is damaged gzip ({error}): copy it again") from error
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror}") from error
