"""Chunks of MCAP files, also of those whose recording was cut off; one message of any bag."""

from bisect import bisect_left
from collections.abc import Collection, Iterator, Mapping, Sequence
from mmap import mmap
from operator import attrgetter
from struct import Struct
from typing import BinaryIO, NamedTuple

from rosbags.interfaces import Connection
from rosbags.rosbag2.storage_mcap import ChunkInfo, McapReader, decompress

RECORD = Struct("<BQ")  # kind and size of a record
MESSAGE_KIND, CHUNK_KIND = 5, 6
MESSAGE_HEAD = Struct("<HIQQ")  # channel, number, stamps of recording and of publication
CHUNK_HEAD = Struct("<QQQI")  # after the record's header: first and last stamp, size, checksum
COMPRESSION = Struct("<I")
STAMP = attrgetter("stamp_ns")


class BagMessage(NamedTuple):
    """One serialised message of a bag."""

    connection: Connection  # its topic and type
    stamp_ns: int  # [ns] when it was recorded
    data: bytes  # CDR

    @property
    def topic(self) -> str:
        """Its topic."""
        return self.connection.topic

    @property
    def msgtype(self) -> str:
        """Its type, for example pose_msgs/msg/Skeleton."""
        return self.connection.msgtype


def messages_in_order(
    storage: McapReader, topics: Collection[str]
) -> Iterator[Sequence[BagMessage]]:
    """Messages of an open file with chunks by their stamps, those with equal ones as written.

    They are those of ``storage.messages``, which takes three times as long.
    """
    connections = {each.id: each for each in storage.connections if each.topic in topics}
    waiting: list[BagMessage] = []  # because chunks may overlap
    for chunk in sorted(storage.chunks, key=lambda each: each.message_start_time):
        if any(chunk.channel_count.get(channel) for channel in connections):
            passed = bisect_left(waiting, chunk.message_start_time, key=STAMP)
            yield waiting[:passed]
            assert storage.bio is not None
            found = _messages_of_chunk(read_chunk(storage.bio, chunk), connections)
            waiting = sorted([*waiting[passed:], *found], key=STAMP)
    yield waiting


def _messages_of_chunk(
    records: bytes, connections: Mapping[int, Connection]
) -> Iterator[BagMessage]:
    """Messages of some channels, in the order of a chunk's decompressed records."""
    at, head_size = 0, RECORD.size + MESSAGE_HEAD.size
    while at < len(records):
        kind, size = RECORD.unpack_from(records, at)
        stop = at + RECORD.size + size
        if stop > len(records):
            raise ValueError(f"a record of {size} bytes is cut off")
        if kind == MESSAGE_KIND:
            channel, _, stamp_ns, _ = MESSAGE_HEAD.unpack_from(records, at + RECORD.size)
            if channel in connections:
                yield BagMessage(connections[channel], stamp_ns, records[at + head_size : stop])
        at = stop


def scanned_chunks(storage: McapReader) -> list[ChunkInfo]:
    """Find the chunks of a file whose recording was interrupted before it wrote their index.

    Args:
        storage: An open reader of a file without an index of its chunks.

    Returns:
        The chunks in the file's order; none if there are messages outside of them.
    """
    file = storage.bio
    assert file is not None
    chunks: list[ChunkInfo] = []
    at = storage.data_start
    while at < storage.data_end:
        file.seek(at)
        kind, size = RECORD.unpack(file.read(RECORD.size))
        if kind == MESSAGE_KIND:
            return []
        if kind == CHUNK_KIND:
            chunks.append(chunk_info(file, at, size))
        at += RECORD.size + size
    return chunks


def chunk_info(file: BinaryIO | mmap, at: int, size: int) -> ChunkInfo:
    """Index entry of a chunk whose record begins at the offset ``at``; its head has been read."""
    start_ns, end_ns, unpacked_size, _ = CHUNK_HEAD.unpack(file.read(CHUNK_HEAD.size))
    (length,) = COMPRESSION.unpack(file.read(COMPRESSION.size))
    compression = file.read(length).decode()
    packed_size = int.from_bytes(file.read(8), "little")
    return ChunkInfo(
        message_start_time=start_ns,
        message_end_time=end_ns,
        chunk_start_offset=at,
        chunk_length=RECORD.size + size,
        message_index_offsets={},
        message_index_length=0,
        compression=compression,
        compressed_size=packed_size,
        uncompressed_size=unpacked_size,
        channel_count={},
    )


def read_chunk(file: BinaryIO | mmap, chunk: ChunkInfo) -> bytes:
    """A chunk's records, decompressed after a check of its checksum."""
    file.seek(chunk.chunk_start_offset + RECORD.size)
    *_, checksum = CHUNK_HEAD.unpack(file.read(CHUNK_HEAD.size))
    file.seek(COMPRESSION.size + len(chunk.compression) + 8, 1)
    packed = file.read(chunk.compressed_size)
    if len(packed) != chunk.compressed_size:
        raise ValueError(f"a chunk is cut off after {len(packed)} bytes")
    return decompress(packed, chunk.compression, chunk.uncompressed_size, checksum)
