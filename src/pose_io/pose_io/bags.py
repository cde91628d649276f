"""Reading rosbags (rosbag2: MCAP or sqlite3) without ROS.

Messages are the dataclasses of a rosbags typestore (``typestore.types["pose_msgs/msg/Skeleton"]``)
or serialised CDR bytes; both have the same fields as the ROS messages.
"""

import shutil
import tempfile
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass
from itertools import chain, islice
from pathlib import Path
from typing import Any

from rosbags.highlevel import AnyReader
from rosbags.interfaces import Connection, Qos, QosDurability
from rosbags.rosbag2.storage_mcap import McapReader
from rosbags.typesys.store import Typestore

from pose_core.errors import InputError, one_line
from pose_io import mcap
from pose_io.mcap import BagMessage as BagMessage
from pose_io.renamed_topics import Renaming, checked_names
from pose_io.typestore import make_typestore, message_types

BAG_SUFFIXES = (".mcap", ".db3")
BATCH = 2000  # [messages] read at a time

Progress = Callable[[float], None]
"""Called with the fraction of the bag that has been read, 0 to 1."""


@dataclass(frozen=True, kw_only=True)
class BagTopic:
    """A topic of a bag."""

    name: str
    msgtype: str  # for example pose_msgs/msg/Skeleton
    count: int  # [messages]
    offered: tuple[Qos, ...] = ()  # QoS that the recorded publishers offered

    @property
    def latched(self) -> bool:
        """Whether it is transient local: offered to late subscribers too."""
        return any(one.durability == QosDurability.TRANSIENT_LOCAL for one in self.offered)


class BagReader:
    """An open bag; made by :func:`open_bag`, closed by ``with`` or :meth:`close`.

    Messages are read in the order of their recording stamps, some thousand at a time: memory does
    not depend on the bag's length.
    """

    def __init__(
        self, path: Path, reader: AnyReader, temporary: Path | None, renamings: Sequence[Renaming]
    ) -> None:
        self.path = path
        self._reader = reader
        self._temporary = temporary  # a folder that is removed when the bag is closed
        self._ours = reader.default_typestore or make_typestore()
        self.typestore: Typestore = reader.typestore
        """The bag's own message definitions; ours for a bag without any."""
        self.remarks: Sequence[str] = ()
        """Lines about frames that a recording of skeletons lost on its way into this bag."""
        self._names = checked_names(renamings, {each.topic for each in reader.connections}, path)
        self.topics: dict[str, BagTopic] = {}
        for connection in map(self._renamed, reader.connections):
            known = self.topics.get(connection.topic)
            self.topics[connection.topic] = BagTopic(
                name=connection.topic,
                msgtype=connection.msgtype,
                count=connection.msgcount + (known.count if known else 0),
                offered=(
                    *(known.offered if known else ()),
                    *getattr(connection.ext, "offered_qos_profiles", ()),
                ),
            )
        self.message_count: int = reader.message_count
        self.start_ns: int = reader.start_time
        self.end_ns: int = reader.end_time - 1  # rosbags gives the end of a half-open interval
        self.duration_s: float = (self.end_ns - self.start_ns) * 1e-9

    def share_before(self, stamp_ns: int) -> float:
        """Fraction of the bag's duration before a stamp [ns], 0 to 1."""
        return (stamp_ns - self.start_ns) / max(1, self.end_ns - self.start_ns)

    def topics_of_type(self, msgtype: str) -> list[str]:
        """The topics with a message type, in the bag's order."""
        return [topic.name for topic in self.topics.values() if topic.msgtype == msgtype]

    def messages(self, topics: Collection[str] | None = None) -> Iterator[BagMessage]:
        """All messages, or those of some topics, in the order of their stamps.

        Raises:
            InputError: If the bag is found to be damaged.
        """
        for batch in self.batches(topics):
            yield from batch

    def batches(self, topics: Collection[str] | None = None) -> Iterator[list[BagMessage]]:
        """The messages in batches of :data:`BATCH`.

        Raises:
            InputError: If the bag is found to be damaged.
        """
        every = self._reader.connections
        connections = [
            each for each in every if topics is None or self._renamed(each).topic in topics
        ]
        if not connections:  # rosbags takes an empty list for "all"
            return
        try:
            entries = self._entries(connections)
            while batch := list(islice(entries, BATCH)):
                if self._names:
                    yield [
                        each._replace(connection=self._renamed(each.connection)) for each in batch
                    ]
                else:
                    yield batch
        except Exception as error:  # damaged bytes may raise any exception
            raise InputError(
                f"{self.path} is damaged: {one_line(error)}: record it again, or repair it "
                f"with './pose doctor {self.path} --output REPAIRED'"
            ) from error

    def _entries(self, connections: Sequence[Connection]) -> Iterator[BagMessage]:
        """The messages of some connections in the order of their stamps."""
        files, reader = _mcap_files(self._reader), self._reader.readers[0]
        has_chunks = files and all(each.chunks for each in files)
        if not has_chunks or getattr(reader, "compression_mode", None) == "message":
            return map(BagMessage._make, self._reader.messages(connections))
        topics = {each.topic for each in connections}
        batches = chain.from_iterable(mcap.messages_in_order(each, topics) for each in files)
        return chain.from_iterable(batches)

    def _renamed(self, connection: Connection) -> Connection:
        name = self._names.get(connection.topic)
        return connection if name is None else connection._replace(topic=name)

    def deserialize(self, message: BagMessage) -> Any:
        """Deserialise a message by the bag's own definitions.

        Raises:
            InputError: If the bytes are not such a message.
        """
        try:
            return self._reader.deserialize(message.data, message.msgtype)
        except KeyError as error:
            raise InputError(
                f"{self.path} holds no definition of {message.msgtype} ({message.topic})"
            ) from error
        except Exception as error:  # damaged bytes may raise any exception
            raise InputError(
                f"{self.path}: a message of {message.topic} is not a {message.msgtype}: "
                f"{one_line(error)}"
            ) from error

    def is_defined_as_ours(self, msgtype: str) -> bool:
        """Whether the bag's definition of a message type is the one of this version."""
        theirs, ours = self._reader.typestore.fielddefs, self._ours.fielddefs
        names = [msgtype]
        for name in names:  # grows
            if name not in theirs or theirs[name][1] != ours[name][1]:
                return False
            names += [part for part in message_types(ours[name][1]) if part not in names]
        return True

    def in_our_bytes(self, message: BagMessage) -> bytes:
        """Serialise a message of another definition by the definition of this version.

        Raises:
            InputError: If the bytes are not such a message, or a field is missing.
        """
        content = self.deserialize(message)
        try:
            return bytes(self._ours.serialize_cdr(content, message.msgtype))
        except Exception as error:  # a missing or different field may raise any exception
            raise InputError(
                f"{self.path} defines {message.msgtype} differently, and its messages cannot be "
                f"converted: {one_line(error)}"
            ) from error

    def close(self) -> None:
        """Close the files."""
        self._reader.close()
        if self._temporary is not None:
            shutil.rmtree(self._temporary, ignore_errors=True)

    def __enter__(self) -> "BagReader":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def open_bag(path: Path | str, renamings: Sequence[Renaming] = ()) -> BagReader:
    """Open a bag: a rosbag2 folder, one ``.mcap`` or ``.db3`` file, or a recording of skeletons.

    Args:
        path: The folder or file; a recording is any that :mod:`pose_io.recordings` reads. It is
            converted to a temporary bag, which is removed when it is closed.
        renamings: Old and new name of topics to be read under another name.

    Raises:
        InputError: If there is no file, or it is not a bag, damaged or empty; or it has no topic
            of an old name.
    """
    path = Path(path)
    if not path.exists():
        raise InputError(
            f"found no bag at {path}: there is no such file or folder (a bag is a rosbag2 folder, "
            "an .mcap or a .db3 file; a recording of skeletons will do, too)"
        )
    if _may_be_recording(path):
        return _open_recording(path, renamings)
    if path.is_dir() and not (path / "metadata.yaml").exists():
        files = [*path.glob("*.mcap"), *path.glob("*.db3")]
        if len(files) != 1:
            raise InputError(
                f"{path} is not a bag, and holds no recordings of skeletons: it has no "
                f"metadata.yaml and {len(files) or 'no'} .mcap or .db3 files (of a bag in several "
                "files, 'ros2 bag reindex' makes the metadata.yaml)"
            )
        path = files[0]  # its recording was interrupted
    return _open(path, path, renamings)


def _open(
    path: Path, shown: Path, renamings: Sequence[Renaming], temporary: Path | None = None
) -> BagReader:
    """Open a bag; messages name it by the path ``shown``."""
    try:
        reader = AnyReader([path], default_typestore=make_typestore())
        reader.open()
        _find_chunks(reader)
    except Exception as error:  # damaged bytes may raise any exception
        raise InputError(
            f"{path} is not a readable bag: {one_line(error)}: if recording or copying it was "
            f"interrupted, copy it again, or repair it with "
            f"'./pose doctor {path} --output REPAIRED'"
        ) from error
    if reader.message_count == 0:
        reader.close()
        raise InputError(f"{path} is an empty bag: it holds no messages")
    return BagReader(shown, reader, temporary, renamings)


def _may_be_recording(path: Path) -> bool:
    """Whether a file's name, or a folder's content, is not that of a bag."""
    if path.is_dir():
        return not (path / "metadata.yaml").exists() and any(path.glob("sk_*_*.txt"))
    return path.suffix not in BAG_SUFFIXES


def _open_recording(path: Path, renamings: Sequence[Renaming]) -> BagReader:
    """Open a recording of skeletons, converted to the bag that the bridges would have recorded."""
    # Imported here: the readers take long to load, and bags do not need them.
    from pose_io.recording_bag import renaming_lines, write_recording_bag
    from pose_io.recordings.formats import detect_format, read_recording
    from pose_io.recordings.timeline import make_timeline, order_lines

    try:
        detect_format(path)
    except InputError as error:
        raise InputError(
            f"{path} is not a bag: expected a rosbag2 folder, an .mcap or .db3 file, or a "
            f"recording of skeletons ({error})"
        ) from error
    recording = read_recording(path)
    temporary = Path(tempfile.mkdtemp(prefix="pose-recording-"))
    try:
        write_recording_bag(recording, temporary / "bag")
        bag = _open(temporary / "bag", path, renamings, temporary)
    except BaseException:
        shutil.rmtree(temporary, ignore_errors=True)
        raise
    names = [stream.name for stream in recording.streams]
    bag.remarks = [
        *renaming_lines(names),
        *(line for one in recording.streams for line in order_lines(one, make_timeline(one))),
    ]
    return bag


def _find_chunks(reader: AnyReader) -> None:
    """Add what rosbags needs to sort messages, in MCAP files without an index."""
    for each in _mcap_files(reader):
        each.chunks = each.chunks or mcap.scanned_chunks(each)
        for chunk in each.chunks:
            if not chunk.channel_count:  # any channel may have messages in it
                chunk.channel_count.update(dict.fromkeys(each.channels, 1))


def _mcap_files(reader: AnyReader) -> list[McapReader]:
    """The files of a bag that are MCAP, in their order."""
    storage = getattr(reader.readers[0], "storage", None)
    files = getattr(storage, "storages", [storage])
    return [each for each in files if isinstance(each, McapReader)]
