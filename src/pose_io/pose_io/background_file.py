"""A file that a thread writes to: whoever has more to compute need not wait for the disk."""

from queue import Queue
from threading import Thread
from typing import BinaryIO

WAITING = 64  # [pieces] that wait to be written at most, then the caller does: some megabytes


class BackgroundFile:
    """Writes what it is given, in order, a little later.

    An error of the disk is raised by the next :meth:`write`, or by :meth:`close`; once.

    Args:
        file: Open for writing; is this one's from now on.
    """

    def __init__(self, file: BinaryIO) -> None:
        self._file = file
        self._size = file.tell()
        self._pieces: Queue[bytes | memoryview | None] = Queue(WAITING)
        self._error: OSError | None = None
        self._thread = Thread(target=self._write_on, name="bag", daemon=True)
        self._thread.start()

    def write(self, data: bytes | memoryview) -> int:
        """Have bytes written, which must not change any more; how many."""
        self._raise_error()
        self._pieces.put(data)
        self._size += len(data)
        return len(data)

    def tell(self) -> int:
        """Where the next bytes will stand."""
        return self._size

    def close(self) -> None:
        """Wait until all is written, and close the file."""
        if self._file.closed:
            return
        self._pieces.put(None)
        self._thread.join()
        try:
            self._raise_error()
        finally:
            self._file.close()

    def _raise_error(self) -> None:
        error, self._error = self._error, None
        if error is not None:
            raise error

    def _write_on(self) -> None:
        has_failed = False
        while (piece := self._pieces.get()) is not None:
            if has_failed:
                continue  # nothing may stand behind a gap
            try:
                self._file.write(piece)
            except OSError as error:
                has_failed, self._error = True, error
