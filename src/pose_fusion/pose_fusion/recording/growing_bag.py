"""Records serialised messages into a rosbag2 folder that can be read at any moment.

About once a second what has arrived is completed on disk: an MCAP file then ends in a valid end
(which the next messages overwrite), a sqlite3 file in a committed transaction. A killed process
or a full disk therefore costs what came after that, not the recording.
"""

import contextlib
import os
import shutil
import sqlite3
import time
from collections.abc import Iterator
from itertools import count
from pathlib import Path
from typing import cast

from rosbags.interfaces import Connection, Qos
from rosbags.rosbag2 import Writer, WriterError
from rosbags.rosbag2.storage_mcap import McapWriter
from rosbags.rosbag2.storage_sqlite3 import Sqlite3Writer

from pose_core.errors import InputError, PoseError
from pose_io.bag_repair import END
from pose_io.bag_writer import STORAGES
from pose_io.typestore import make_typestore, require_type

MAX_PENDING = 1 << 19  # [bytes] below the size at which rosbags completes a chunk by itself


def free_path(path: Path) -> Path:
    """The path itself, or with the first of -2, -3, … that does not exist yet.

    Raises:
        InputError: If the path has no name, such as ``.``.
    """
    return list(_series(path))[-1]


def dated_path() -> Path:
    """Where a recording goes that nobody has named."""
    return free_path(Path("out") / time.strftime("record-%Y%m%d-%H%M%S"))


def was_cut_short(path: Path) -> bool:
    """Whether the last bag of the series was left incomplete: its recorder was killed.

    Raises:
        InputError: If the path has no name, such as ``.``.
    """
    *existing, _ = _series(path)
    last = existing[-1] if existing else path
    files = [*last.glob("*.mcap"), *last.glob("*.db3")]
    return bool(files) and not (last / "metadata.yaml").exists()


def _series(path: Path) -> Iterator[Path]:
    """The path, then with -2, -3, …, up to the first that does not exist yet."""
    if not path.name:
        raise InputError(f"{path} exists already: name a folder to be made")
    candidate = path
    for number in count(2):
        yield candidate
        if not os.path.lexists(candidate):
            return
        candidate = path.with_name(f"{path.name}-{number}")


class RecordingError(PoseError):
    """The recording had to end: the disk is full, or cannot be written."""


class ExistsError(InputError):
    """The folder to be made exists."""


class GrowingBag:
    """A growing bag.

    Args:
        path: The folder to make; it must not exist.
        storage: ``mcap`` or ``sqlite3``.
        least_free: The recording ends while this much disk is still free [bytes].

    Raises:
        ExistsError: If the folder exists.
        InputError: If it cannot be made.
    """

    def __init__(self, path: Path, storage: str = "mcap", least_free: int = 0) -> None:
        self.path = path
        self._least_free = least_free
        self._typestore = make_typestore()
        self._connections: dict[str, Connection] = {}
        self._pending = 0  # [bytes] since the last flush
        self.size = 0  # [bytes] of messages
        self._end = 0  # [bytes] of the file that are complete, the MCAP end not counted
        self._flushed_counts: dict[int, int] = {}
        try:
            self._writer = Writer(path, version=9, storage_plugin=STORAGES[storage])
            path.parent.mkdir(parents=True, exist_ok=True)
            self._writer.open()
        except WriterError as error:
            message = f"{path} exists already: name another folder, or remove it first"
            raise ExistsError(message) from error
        except (OSError, sqlite3.Error) as error:
            shutil.rmtree(path, ignore_errors=True)  # made just now
            raise InputError(f"cannot write {path}: {_reason(error)}") from error

    @property
    def is_over(self) -> bool:
        """Whether it has ended, by itself or not."""
        return self._writer.storage is None

    @property
    def counts(self) -> dict[str, int]:
        """Messages by topic."""
        return {
            topic: self._writer.counts[connection.id]
            for topic, connection in self._connections.items()
        }

    @property
    def message_count(self) -> int:
        """Messages on all topics."""
        return sum(self._writer.counts.values())

    def add_topic(self, topic: str, msgtype: str, qos: list[Qos]) -> None:
        """Declare a topic: its type (``pose_msgs/msg/Skeleton``), its publishers' QoS.

        Once the bag is over, only the type is checked.

        Raises:
            InputError: If no installed package defines the type.
        """
        require_type(self._typestore, msgtype)
        if self.is_over:
            return
        self._connections[topic] = self._writer.add_connection(
            topic, msgtype, typestore=self._typestore, offered_qos_profiles=qos
        )

    def write(self, topic: str, data: bytes, stamp_ns: int) -> None:
        """Append a message's CDR bytes, received at ``stamp_ns`` [ns].

        Raises:
            RecordingError: If the disk cannot take it; the recording is then over.
        """
        try:
            self._writer.write(self._connections[topic], stamp_ns, data)
        except (OSError, sqlite3.Error) as error:
            raise self._failed(error) from error
        self._pending += len(data)
        self.size += len(data)
        if self._pending > MAX_PENDING:
            self.flush()

    def flush(self) -> None:
        """Complete on disk what has come so far.

        Raises:
            RecordingError: If the disk is (nearly) full; the recording is then over.
        """
        if not self._pending:
            return
        try:
            free = shutil.disk_usage(self.path).free
        except OSError as error:  # the folder has gone
            raise self._failed(error) from error
        if free < self._least_free:
            self.close()
            raise RecordingError(
                f"only {free / 1e6:.0f} MB are free at {self.path}: the recording ends here,"
                f" complete, with {self.message_count} messages; make room"
            )
        storage = self._writer.storage
        try:
            if isinstance(storage, McapWriter):
                storage.close_chunk()
                self._end = storage.bio.tell()
                storage.bio.write(END)
                storage.bio.flush()
                storage.bio.seek(self._end)
            elif isinstance(storage, Sqlite3Writer):
                storage.conn.commit()
        except (OSError, sqlite3.Error) as error:
            raise self._failed(error) from error
        self._pending = 0
        self._flushed_counts = dict(self._writer.counts)

    def close(self) -> None:
        """Complete the bag; without messages, remove it.

        Raises:
            RecordingError: If the disk cannot take the rest.
        """
        if self._writer.storage is None:
            return
        if self.message_count == 0:
            self._writer.abort()
            shutil.rmtree(self.path)
            return
        try:
            self._writer.close()
        except (OSError, sqlite3.Error) as error:
            raise self._failed(error) from error

    def _failed(self, error: Exception) -> RecordingError:
        """End the recording at the last flush; the error to raise."""
        storage, self._writer.storage = self._writer.storage, None
        if storage is not None:
            with contextlib.suppress(OSError, sqlite3.Error):
                storage.abort()
        self._writer.counts = {key: self._flushed_counts.get(key, 0) for key in self._writer.counts}
        saved = f"the first {self.message_count} messages are in {self.path}"
        if self.message_count == 0:
            shutil.rmtree(self.path, ignore_errors=True)
            saved = "nothing was saved"
        elif storage is not None:
            with contextlib.suppress(OSError):
                if isinstance(storage, McapWriter):
                    os.truncate(storage.path, self._end)
                    with storage.path.open("ab") as end:
                        end.write(END)
                # What is left to write is the description beside the file.
                self._writer.storage = cast(McapWriter, _Ended(storage.path))
                self._writer.close()
        return RecordingError(f"cannot write {self.path}: {_reason(error)}; {saved}")


def _reason(error: Exception) -> str:
    return str(getattr(error, "strerror", None) or error)


class _Ended:
    """In the place of a storage whose file is already as it should be."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def close(self, version: int, metadata: str) -> None:
        """Leave the file as it is."""
