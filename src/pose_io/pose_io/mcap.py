"""MCAP files read and written many messages at a time, with less ado for each than by rosbags."""

from collections.abc import Collection, Iterator, Sequence
from operator import itemgetter
from struct import Struct

import numpy as np
from numpy.typing import NDArray
from rosbags.interfaces import Connection
from rosbags.rosbag2.storage_mcap import ChunkInfo, McapReader, McapWriter, decompress

RECORD = Struct("<BQ")  # kind and size of a record
MESSAGE = Struct("<BQHIQQ")  # of a message: channel, sequence, recorded at, published at
MESSAGE_KIND = 5
CHUNK_HEAD = Struct("<QQQI")  # after the record's own: first and last stamp, size, checksum
COMPRESSION = Struct("<I")
STAMPS = slice(15, 31)  # [bytes] of a message's record: when it was recorded and published
CHUNK_SIZE = 2**20  # [bytes] as rosbags begins a new one

Entry = tuple[Connection, int, bytes]
"""A message: its connection, when it was recorded [ns], its bytes."""


def batches(storage: McapReader, connections: Collection[Connection]) -> Iterator[list[Entry]]:
    """The messages of some connections in the order of their stamps, about a chunk at a time.

    Args:
        storage: An open reader of a file with an index of its chunks.
        connections: Those of the file that are wanted.
    """
    wanted = {connection.id: connection for connection in connections}
    chunks = sorted(storage.chunks, key=itemgetter(0))
    chunks = [chunk for chunk in chunks if any(chunk.channel_count.get(id_) for id_ in wanted)]
    held: list[Entry] = []
    for index, chunk in enumerate(chunks):
        held += _entries(_content(storage, chunk), wanted)
        held.sort(key=itemgetter(1))
        if index + 1 == len(chunks):
            break
        # What is later than the next chunk's begin may have to stand among its messages.
        next_ns = chunks[index + 1].message_start_time
        later = len(held)
        while later and held[later - 1][1] >= next_ns:
            later -= 1
        if later:
            yield held[:later]
        held = held[later:]
    if held:
        yield held


def _content(storage: McapReader, chunk: ChunkInfo) -> bytes:
    """A chunk's records, checked and unpacked."""
    file = storage.bio
    assert file is not None
    file.seek(chunk.chunk_start_offset + RECORD.size)
    *_, checksum = CHUNK_HEAD.unpack(file.read(CHUNK_HEAD.size))
    file.seek(COMPRESSION.size + len(chunk.compression) + 8, 1)
    packed = file.read(chunk.compressed_size)
    if len(packed) != chunk.compressed_size:
        raise ValueError(f"a chunk is cut off after {len(packed)} bytes")
    return decompress(packed, chunk.compression, chunk.uncompressed_size, checksum)


def _entries(content: bytes, wanted: dict[int, Connection]) -> Iterator[Entry]:
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
                yield connection, stamp_ns, content[at + MESSAGE.size : stop]
        at = stop


def append_rows(
    storage: McapWriter,
    connections: Sequence[Connection],
    stamps_ns: NDArray[np.int64],
    rows: Sequence[NDArray[np.uint8]],
) -> None:
    """Append messages that differ in nothing but their bytes: as many of each connection.

    Args:
        storage: An open writer.
        connections: Whose messages they are.
        stamps_ns: When they were recorded, (n,): at each stamp a message of every connection.
        rows: The messages of each connection, (n, bytes).
    """
    sizes = [MESSAGE.size + data.shape[1] for data in rows]
    begins = np.cumsum([0, *sizes])
    records = np.empty((len(stamps_ns), begins[-1]), np.uint8)
    stamp_bytes = np.ascontiguousarray(stamps_ns, "<i8").view(np.uint8).reshape(-1, 8)
    for connection, data, begin in zip(connections, rows, begins[:-1].tolist(), strict=True):
        size = MESSAGE.size - RECORD.size + data.shape[1]
        head = MESSAGE.pack(MESSAGE_KIND, size, connection.id, 0, 0, 0)
        record = records[:, begin : begin + MESSAGE.size + data.shape[1]]
        record[:, : MESSAGE.size] = np.frombuffer(head, np.uint8)
        record[:, STAMPS] = np.tile(stamp_bytes, 2)
        record[:, MESSAGE.size :] = data
    start = 0
    while start < len(records):
        room = CHUNK_SIZE - storage.chunk.bio.tell()
        stop = min(len(records), start + 1 + max(room, 0) // records.shape[1])
        _append(storage, connections, stamps_ns[start:stop], begins[:-1], records[start:stop])
        start = stop


def _append(
    storage: McapWriter,
    connections: Sequence[Connection],
    stamps_ns: NDArray[np.int64],
    begins: NDArray[np.int64],
    records: NDArray[np.uint8],
) -> None:
    """Append records to the chunk, note where they are, and close it when it is full."""
    chunk, count = storage.chunk, len(records)
    first_ns, last_ns = int(stamps_ns.min()), int(stamps_ns.max())
    for times in (chunk, storage):
        times.message_start_time = min(first_ns, times.message_start_time)
        times.message_end_time = max(last_ns, times.message_end_time)
    row_starts = chunk.bio.tell() + records.shape[1] * np.arange(count)
    stamps = stamps_ns.tolist()
    for connection, begin in zip(connections, begins.tolist(), strict=True):
        places = (row_starts + begin).tolist()
        chunk.msgs[connection.id].extend(zip(stamps, places, strict=True))
        storage.channel_stats[connection.id] += count
    chunk.bio.write(records.data)
    if chunk.bio.tell() > CHUNK_SIZE:
        storage.close_chunk()
