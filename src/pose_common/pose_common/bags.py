"""Reading and writing rosbags (rosbag2: MCAP or sqlite3) without ROS.

Messages are the dataclasses of a rosbags typestore (``typestore.types["pose_msgs/msg/Skeleton"]``)
or serialised CDR bytes; both have the same fields as the ROS messages.
"""

import os
import shutil
import sqlite3
import tempfile
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from types import TracebackType
from typing import Any

from ament_index_python.packages import PackageNotFoundError, get_package_share_directory
from rosbags.highlevel import AnyReader
from rosbags.interfaces import (
    Connection,
    Nodetype,
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.rosbag2.reader import DirectoryReader
from rosbags.rosbag2.storage_mcap import McapReader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from pose_common import mcap
from pose_common.errors import InputError
from pose_common.mcap import Entry

STORAGES = {"mcap": StoragePlugin.MCAP, "sqlite3": StoragePlugin.SQLITE3}
OWN_PACKAGES = ("pose_msgs",)
BATCH = 2000  # [messages] that are read at a time where there are no chunks
INFINITE = QosTime(9223372036, 854775807)  # RMW_DURATION_INFINITE


def make_typestore() -> Typestore:
    """The messages of ROS 2 Jazzy and, from the installed packages, our own."""
    typestore = get_typestore(Stores.ROS2_JAZZY)
    for package in OWN_PACKAGES:
        register_package(typestore, package)
    return typestore


def register_package(typestore: Typestore, package: str) -> None:
    """Add the messages of an installed package to a typestore.

    Raises:
        InputError: If the package is not installed, or holds no messages.
    """
    try:
        folder = Path(get_package_share_directory(package)) / "msg"
    except (PackageNotFoundError, ValueError) as error:
        raise InputError(
            f"package '{package}' is not installed: build and source it to use its messages"
        ) from error
    types: dict[str, Any] = {}
    for path in sorted(folder.glob("*.msg")):
        types.update(get_types_from_msg(path.read_text(), f"{package}/msg/{path.stem}"))
    if not types:
        raise InputError(f"package '{package}' has no messages in {folder}")
    typestore.register(
        {name: type_ for name, type_ in types.items() if name not in typestore.types}
    )


@dataclass(frozen=True, kw_only=True)
class Topic:
    """What a bag says of one topic."""

    name: str
    msgtype: str  # for example pose_msgs/msg/Skeleton
    count: int  # [messages]
    latched: bool  # transient local: late subscribers want it too
    offered: tuple[Qos, ...] = ()  # what the recorded publishers offered


@dataclass(frozen=True, kw_only=True)
class BagMessage:
    """One serialised message, as it stands in the bag."""

    topic: str
    msgtype: str
    stamp_ns: int  # [ns] when it was recorded
    data: bytes  # CDR


class BagReader:
    """An open bag; made by :func:`open_bag`, closed by ``with`` or :meth:`close`.

    Messages are read in the order of their recording stamps, a chunk at a time: memory does not
    depend on the bag's length.
    """

    def __init__(self, path: Path, reader: AnyReader) -> None:
        self.path = path
        self._reader = reader
        self._ours = reader.default_typestore or make_typestore()
        self.topics: dict[str, Topic] = {}
        for connection in reader.connections:
            known = self.topics.get(connection.topic)
            self.topics[connection.topic] = Topic(
                name=connection.topic,
                msgtype=connection.msgtype,
                count=connection.msgcount + (known.count if known else 0),
                latched=_is_latched(connection) or (known is not None and known.latched),
                offered=(*(known.offered if known else ()), *_offered(connection)),
            )
        self.message_count: int = reader.message_count
        self.start_ns: int = reader.start_time
        self.end_ns: int = reader.end_time - 1  # rosbags gives the end of a half-open interval
        self.duration_s: float = (self.end_ns - self.start_ns) * 1e-9

    def topics_of_type(self, msgtype: str) -> list[str]:
        """The topics that carry a message type, in the bag's order."""
        return [topic.name for topic in self.topics.values() if topic.msgtype == msgtype]

    def messages(self, topics: Collection[str] | None = None) -> Iterator[BagMessage]:
        """All messages, or those of some topics, in the order of their stamps.

        Raises:
            InputError: If the bag turns out to be damaged.
        """
        for batch in self.batches(topics):
            for connection, stamp_ns, data in batch:
                yield BagMessage(
                    topic=connection.topic,
                    msgtype=connection.msgtype,
                    stamp_ns=stamp_ns,
                    data=data,
                )

    def batches(self, topics: Collection[str] | None = None) -> Iterator[list[Entry]]:
        """The same some thousand at a time: connection (topic and type), stamp [ns], bytes.

        Raises:
            InputError: If the bag turns out to be damaged.
        """
        connections = [
            connection
            for connection in self._reader.connections
            if topics is None or connection.topic in topics
        ]
        if not connections:  # rosbags takes an empty list for "all"
            return
        try:
            storage = _indexed_mcap(self._reader)
            if storage is not None:
                yield from mcap.batches(storage, connections)
                return
            entries = self._reader.messages(connections)
            while batch := list(islice(entries, BATCH)):
                yield batch
        except Exception as error:  # whatever a parser meets in damaged bytes
            raise InputError(
                f"{self.path} is damaged: {_one_line(error)}: record it again, or mend it with "
                "'ros2 bag reindex'"
            ) from error

    def deserialize(self, message: BagMessage) -> Any:
        """The message's fields, read by the definitions that the bag itself holds.

        Raises:
            InputError: If the bytes are not such a message.
        """
        try:
            return self._reader.deserialize(message.data, message.msgtype)
        except KeyError as error:
            raise InputError(
                f"{self.path} holds no definition of {message.msgtype} ({message.topic})"
            ) from error
        except Exception as error:  # whatever a parser meets in damaged bytes
            raise InputError(
                f"{self.path}: a message of {message.topic} is not a {message.msgtype}: "
                f"{_one_line(error)}"
            ) from error

    def is_defined_as_ours(self, msgtype: str) -> bool:
        """Whether the bag's messages of a type have the bytes that ours have."""
        theirs, ours = self._reader.typestore.fielddefs, self._ours.fielddefs
        names = [msgtype]
        for name in names:  # grows
            if name not in theirs or theirs[name][1] != ours[name][1]:
                return False
            names += [part for part in _parts(ours[name][1]) if part not in names]
        return True

    def in_our_bytes(self, message: BagMessage) -> bytes:
        """A message of another definition as ours would be written.

        Raises:
            InputError: If the bytes are not such a message, or a field is missing.
        """
        content = self.deserialize(message)
        try:
            return bytes(self._ours.serialize_cdr(content, message.msgtype))
        except Exception as error:  # whatever a field that is missing or another leads to
            raise InputError(
                f"{self.path} defines {message.msgtype} otherwise, and its messages do not fit "
                f"ours: {_one_line(error)}"
            ) from error

    def close(self) -> None:
        """Close the files."""
        self._reader.close()

    def __enter__(self) -> "BagReader":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()


def open_bag(path: Path | str, typestore: Typestore | None = None) -> BagReader:
    """Open a bag: a rosbag2 folder, or one ``.mcap`` or ``.db3`` file.

    Args:
        path: The folder or file.
        typestore: Definitions for a bag that holds none itself; ours if None.

    Raises:
        InputError: If there is nothing there, or no bag, or a damaged or empty one.
    """
    path = Path(path)
    if not path.exists():
        raise InputError(f"found no bag at {path}: expected a rosbag2 folder or an .mcap file")
    if path.is_dir() and not (path / "metadata.yaml").exists():
        files = list(path.glob("*.mcap"))
        if len(files) != 1:
            raise InputError(
                f"{path} is not a bag: it has neither metadata.yaml nor one .mcap file"
            )
        path = files[0]  # its recording was cut off
    if path.is_file() and path.suffix not in {".mcap", ".db3"}:
        raise InputError(
            f"{path} is not a bag: expected a rosbag2 folder, or an .mcap or .db3 file"
        )
    try:
        reader = AnyReader([path], default_typestore=typestore or make_typestore())
        reader.open()
    except Exception as error:  # whatever a parser meets in damaged bytes
        raise InputError(
            f"{path} is not a readable bag: {_one_line(error)}: if recording or copying it was cut "
            "off, copy it again, or mend it with 'mcap recover' or 'ros2 bag reindex'"
        ) from error
    if reader.message_count == 0:
        reader.close()
        raise InputError(f"{path} is an empty bag: it holds no messages")
    return BagReader(path, reader)


class BagWriter:
    """Writes a bag that appears at its path only when it is complete.

    Until :meth:`close` the bag grows in a hidden folder beside ``path``; :meth:`abort`, or an
    error inside the ``with`` block, removes it. The same calls give the same bytes. Definitions of
    all messages go into the bag.

    Args:
        path: Folder to make.
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
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            # rosbag2 names the files inside after the folder: only the parent's name is temporary.
            self._hidden = Path(
                tempfile.mkdtemp(prefix=f".{self.path.name}.partial-", dir=self.path.parent)
            )
        except OSError as error:
            raise InputError(f"cannot write {self.path}: {error.strerror}") from error
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
            latched: Transient local: a player offers it to late subscribers.
            reliable: Reliable, or best effort.
            depth: Length of the publisher's queue.

        Raises:
            InputError: If the message type is unknown, or the topic already has another one.
        """
        known = self._connections.get(topic)
        if known is not None:
            if known.msgtype != msgtype:
                raise InputError(f"{topic} carries {known.msgtype}, and now {msgtype} too")
            return
        if msgtype not in self.typestore.types:
            register_package(self.typestore, msgtype.split("/")[0])
        if msgtype not in self.typestore.types:
            raise InputError(f"unknown message type '{msgtype}' on {topic}")
        self._connections[topic] = self._writer.add_connection(
            topic,
            msgtype,
            typestore=self.typestore,
            offered_qos_profiles=[_qos(latched=latched, reliable=reliable, depth=depth)],
        )

    def write(self, topic: str, message: Any, stamp_ns: int) -> None:
        """Append a message of the typestore, recorded at ``stamp_ns`` [ns]."""
        msgtype = message.__msgtype__
        data = self.typestore.serialize_cdr(message, msgtype)
        self.write_serialized(topic, msgtype, data, stamp_ns)

    def write_serialized(
        self, topic: str, msgtype: str, data: bytes | memoryview, stamp_ns: int
    ) -> None:
        """Append a message's CDR bytes as they are, recorded at ``stamp_ns`` [ns].

        Raises:
            InputError: If the disk cannot take it, or as of :meth:`add_topic`.
        """
        if topic not in self._connections or self._connections[topic].msgtype != msgtype:
            self.add_topic(topic, msgtype)
        try:
            self._writer.write(self._connections[topic], stamp_ns, data)
        except (OSError, sqlite3.Error) as error:
            raise self._unwritable(error) from error
        self.message_count += 1

    def _unwritable(self, error: Exception) -> InputError:
        reason = (error.strerror if isinstance(error, OSError) else None) or _one_line(error)
        return InputError(f"cannot write {self.path}: {reason}")

    def close(self) -> None:
        """Complete the bag and move it to its path.

        Raises:
            InputError: If something else was put at the path meanwhile, or the disk cannot take
                the end; the bag is then removed.
        """
        try:
            self._writer.close()
            # Renaming onto an empty folder would succeed.
            if self.path.exists():
                raise InputError(f"{self.path} was made by someone else while the bag was written")
            os.rename(self._hidden / self.path.name, self.path)
        except (OSError, sqlite3.Error) as error:
            raise self._unwritable(error) from error
        finally:
            shutil.rmtree(self._hidden, ignore_errors=True)

    def abort(self) -> None:
        """Remove what was written."""
        try:
            self._writer.abort()
        finally:
            shutil.rmtree(self._hidden, ignore_errors=True)

    def __enter__(self) -> "BagWriter":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if kind is None:
            self.close()
        else:
            self.abort()


def write_bag(
    path: Path | str,
    messages: Iterable[tuple[str, Any, int]],
    *,
    storage: str = "mcap",
    typestore: Typestore | None = None,
) -> None:
    """Write (topic, message, stamp_ns) into a new bag, ordered by stamp, ties as given."""
    with BagWriter(path, storage=storage, typestore=typestore) as bag:
        for topic, message, stamp_ns in sorted(messages, key=lambda entry: entry[2]):
            bag.write(topic, message, stamp_ns)


def _indexed_mcap(reader: AnyReader) -> McapReader | None:
    """The one file of a bag, if it is MCAP with an index and packed by chunks, or not at all."""
    storage = getattr(reader.readers[0], "storage", None)
    if isinstance(storage, DirectoryReader):
        if len(storage.storages) != 1 or storage.metadata.compression_mode == "message":
            return None
        (storage,) = storage.storages
    return storage if isinstance(storage, McapReader) and storage.chunks else None


def _parts(fields: Any) -> set[str]:
    """The messages that a definition's fields are made of."""
    parts = set()
    for _, (kind, detail) in fields:
        while kind in (Nodetype.ARRAY, Nodetype.SEQUENCE):
            kind, detail = detail[0]
        if kind == Nodetype.NAME:
            parts.add(detail)
    return parts


def _qos(*, latched: bool, reliable: bool, depth: int) -> Qos:
    return Qos(
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


def _offered(connection: Connection) -> tuple[Qos, ...]:
    return tuple(getattr(connection.ext, "offered_qos_profiles", ()))


def _is_latched(connection: Connection) -> bool:
    return any(
        profile.durability == QosDurability.TRANSIENT_LOCAL for profile in _offered(connection)
    )


def _one_line(error: BaseException) -> str:
    text = str(error).strip().splitlines()
    return text[0].rstrip(".") if text else type(error).__name__
