"""MCAP files read a chunk of messages at a time, also those whose recording was cut off."""

from collections.abc import Collection, Iterator
from mmap import mmap
from operator import attrgetter, itemgetter
from struct import Struct
from typing import BinaryIO, NamedTuple

from rosbags.interfaces import Connection
from rosbags.rosbag2.storage_mcap import ChunkInfo, McapReader, decompress

RECORD = Struct("<BQ")  # kind and size of a record
MESSAGE = Struct("<BQHIQQ")  # header of a message: channel, sequence, recorded at, published at
MESSAGE_KIND, CHUNK_KIND, INDEX_KIND = 5, 6, 7
CHUNK_HEAD = Struct("<QQQI")  # after the record's header: first and last stamp, size, checksum
COMPRESSION = Struct("<I")
INDEX_HEAD = Struct("<HI")  # of a chunk's index: channel, size of its entries
INDEX_ENTRY_SIZE = 16  # [bytes]


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


def batches(storage: McapReader, connections: Collection[Connection]) -> Iterator[list[BagMessage]]:
    """The messages of some connections in the order of their stamps, about a chunk at a time.

    Args:
        storage: An open reader of a file with an index of its chunks.
        connections: The connections to read.
    """
    wanted = {connection.id: connection for connection in connections}
    chunks = sorted(storage.chunks, key=itemgetter(0))
    chunks = [
        chunk
        for chunk in chunks
        if not chunk.channel_count or any(chunk.channel_count.get(id_) for id_ in wanted)
    ]
    file = storage.bio
    assert file is not None
    held: list[BagMessage] = []
    for index, chunk in enumerate(chunks):
        held += _entries(read_chunk(file, chunk), wanted)
        held.sort(key=attrgetter("stamp_ns"))
        if index + 1 == len(chunks):
            break
        # Messages later than the next chunk's start are merged with that chunk's messages.
        next_ns = chunks[index + 1].message_start_time
        later = len(held)
        while later and held[later - 1].stamp_ns >= next_ns:
            later -= 1
        if later:
            yield held[:later]
        held = held[later:]
    if held:
        yield held


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
        elif kind == INDEX_KIND and chunks:
            channel, length = INDEX_HEAD.unpack(file.read(INDEX_HEAD.size))
            chunks[-1].channel_count[channel] = length // INDEX_ENTRY_SIZE
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


def _entries(content: bytes, wanted: dict[int, Connection]) -> Iterator[BagMessage]:
    at, end = 0, len(content)
    head, message, size_of_head = RECORD.unpack_from, MESSAGE.unpack_from, RECORD.size
    while at < end:
        kind, size = head(content, at)
        stop = at + size_of_head + size
        if stop > end:
            raise ValueError(f"a record of {size} bytes reaches beyond its chunk")
        if kind == MESSAGE_KIND:
            _, _, channel, _, stamp_ns, _ = message(content, at)
            connection = wanted.get(channel)
            if connection is not None:
                yield BagMessage(connection, stamp_ns, content[at + MESSAGE.size : stop])
        at = stop
