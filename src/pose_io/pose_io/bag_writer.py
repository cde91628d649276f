"""Writing rosbags (rosbag2: MCAP or sqlite3) without ROS."""

import os
import shutil
import sqlite3
import tempfile
from contextlib import suppress
from pathlib import Path
from typing import Any

from rosbags.interfaces import (
    Connection,
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys.store import Typestore

from pose_core.errors import InputError, one_line, writing
from pose_io.typestore import make_typestore, require_type

STORAGES = {"mcap": StoragePlugin.MCAP, "sqlite3": StoragePlugin.SQLITE3}
INFINITE = QosTime(9223372036, 854775807)  # RMW_DURATION_INFINITE


class BagWriter:
    """Writes a bag, which is moved to its path when it is complete.

    Until :meth:`close`, the bag is in a hidden folder beside ``path``; :meth:`abort`, or an
    error inside the ``with`` block, removes it. The same calls give the same bytes. The bag
    contains the definitions of all its messages.

    Args:
        path: The folder to create.
        storage: ``mcap`` or ``sqlite3``.
        typestore: Definitions of the messages; :func:`make_typestore` if None. Types of other
            installed packages are looked up when they are first written.

    Raises:
        InputError: If the path exists, its parent cannot be written, or the storage is unknown.
    """

    def __init__(
        self, path: Path | str, storage: str = "mcap", typestore: Typestore | None = None
    ) -> None:
        self.path = Path(path)
        self.typestore = typestore or make_typestore()
        self.message_count = 0
        if storage not in STORAGES:
            raise InputError(f"unknown storage '{storage}': expected one of {', '.join(STORAGES)}")
        if self.path.exists():
            raise InputError(f"{self.path} exists already: name another one, or remove it first")
        with writing(self.path):
            self.path.parent.mkdir(parents=True, exist_ok=True)
            # rosbag2 names the files inside after the folder: only the parent's name is temporary.
            self._hidden = Path(
                tempfile.mkdtemp(prefix=f".{self.path.name}.partial-", dir=self.path.parent)
            )
        self._writer = Writer(
            self._hidden / self.path.name, version=9, storage_plugin=STORAGES[storage]
        )
        self._writer.open()
        self._connections: dict[str, Connection] = {}

    def add_topic(
        self,
        topic: str,
        msgtype: str,
        *,
        latched: bool = False,
        reliable: bool = True,
        depth: int = 10,
    ) -> None:
        """Declare a topic; :meth:`write` does so by itself for a topic with the default QoS.

        Args:
            topic: Fully qualified name.
            msgtype: For example ``pose_msgs/msg/Skeleton``.
            latched: Whether the topic is transient local: a player offers it to late subscribers.
            reliable: Whether the topic is reliable; otherwise best effort.
            depth: Length of the publisher's queue.

        Raises:
            InputError: If the message type is unknown, or the topic already has another one.
        """
        known = self._connections.get(topic)
        if known is not None:
            if known.msgtype != msgtype:
                raise InputError(
                    f"{topic} has type {known.msgtype}: cannot add messages of type {msgtype}"
                )
            return
        require_type(self.typestore, msgtype)
        self._connections[topic] = self._writer.add_connection(
            topic,
            msgtype,
            typestore=self.typestore,
            offered_qos_profiles=[
                Qos(
                    QosHistory.KEEP_LAST,
                    depth,
                    QosReliability.RELIABLE if reliable else QosReliability.BEST_EFFORT,
                    QosDurability.TRANSIENT_LOCAL if latched else QosDurability.VOLATILE,
                    INFINITE,
                    INFINITE,
                    QosLiveliness.AUTOMATIC,
                    INFINITE,
                    False,
                )
            ],
        )

    def write(self, topic: str, message: Any, stamp_ns: int) -> None:
        """Append a message of the typestore, recorded at ``stamp_ns`` [ns]."""
        msgtype = message.__msgtype__
        data = self.typestore.serialize_cdr(message, msgtype)
        self.write_serialized(topic, msgtype, data, stamp_ns)

    def write_serialized(
        self, topic: str, msgtype: str, data: bytes | memoryview, stamp_ns: int
    ) -> None:
        """Append a message's CDR bytes unchanged, recorded at ``stamp_ns`` [ns].

        Raises:
            InputError: If it cannot be written, or for the reasons of :meth:`add_topic`.
        """
        if topic not in self._connections or self._connections[topic].msgtype != msgtype:
            self.add_topic(topic, msgtype)
        try:
            self._writer.write(self._connections[topic], stamp_ns, data)
        except (OSError, sqlite3.Error) as error:
            raise self._unwritable(error) from error
        self.message_count += 1

    def _unwritable(self, error: Exception) -> InputError:
        reason = (error.strerror if isinstance(error, OSError) else None) or one_line(error)
        return InputError(f"cannot write {self.path}: {reason}")

    def close(self) -> None:
        """Complete the bag and move it to its path.

        Raises:
            InputError: If the path exists by now, or the end cannot be written; the bag is then
                removed.
        """
        try:
            self._writer.close()
            # Renaming onto an empty folder would succeed.
            if self.path.exists():
                raise InputError(
                    f"{self.path} was created by another program while the bag was written"
                )
            os.rename(self._hidden / self.path.name, self.path)
        except (OSError, sqlite3.Error) as error:
            raise self._unwritable(error) from error
        finally:
            shutil.rmtree(self._hidden, ignore_errors=True)

    def abort(self) -> None:
        """Remove what was written."""
        try:
            with suppress(OSError):  # the bag is removed in any case
                self._writer.abort()
        finally:
            shutil.rmtree(self._hidden, ignore_errors=True)

    def __enter__(self) -> "BagWriter":
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind is None:
            self.close()
        else:
            self.abort()
