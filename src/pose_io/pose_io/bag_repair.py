"""Repair of bags whose recording was interrupted: intact messages copied into a new bag."""

import mmap
import tempfile
from dataclasses import dataclass
from pathlib import Path

from rosbags.interfaces import QosReliability

from pose_core.errors import InputError, writing
from pose_io.bag_writer import BagWriter
from pose_io.bags import Progress, open_bag
from pose_io.mcap import CHUNK_KIND, RECORD, chunk_info, read_chunk

MAGIC = b"\x89MCAP0\r\n"
HEADER_KIND, FOOTER_KIND, DATA_END_KIND = 1, 2, 15
FOOTER_SIZE = 20  # [bytes]
END = (
    b"\x0f" + (4).to_bytes(8, "little") + bytes(4)  # data end, no checksum
    + b"\x02" + FOOTER_SIZE.to_bytes(8, "little") + bytes(FOOTER_SIZE)  # footer, no summary
    + MAGIC
)  # fmt: skip
KINDS = range(HEADER_KIND, DATA_END_KIND + 1)
MIN_DEPTH = 10  # [messages] that a topic's publisher offers when it is played


@dataclass(frozen=True, kw_only=True)
class Condition:
    """Result of examining an MCAP file."""

    whole: int  # [bytes] up to the end of the last intact data record
    size: int  # [bytes] of the file
    ends: bool  # whether the file ends with a footer and the closing magic bytes
    has_index: bool  # without one other programs may refuse the file
    problem: str = ""  # description of what follows the intact part, if it is not the end

    @property
    def is_whole(self) -> bool:
        """Whether the file needs no repair."""
        return self.ends and self.has_index


def mcap_file(bag: Path) -> Path:
    """The one MCAP file of a bag.

    Raises:
        InputError: If there is none, or there are several.
    """
    if bag.is_file() and bag.suffix == ".mcap":
        return bag
    files = sorted(bag.glob("*.mcap"))
    if len(files) != 1:
        found = f"{len(files)} .mcap files" if files else "no .mcap file"
        raise InputError(
            f"{bag} holds {found}: expected a bag of one .mcap file, or that file; of a .db3 file, "
            "'ros2 bag reindex' makes the metadata.yaml, and the other verbs need none"
        )
    return files[0]


def examine(path: Path) -> Condition:
    """Check a file's records from its beginning to its end or its first damaged record.

    Raises:
        InputError: If it cannot be read, or is no MCAP file from the start.
    """
    try:
        with path.open("rb") as file:
            if file.read(len(MAGIC)) != MAGIC:
                raise InputError(
                    f"{path} does not begin as an MCAP file: there is nothing to repair"
                )
            with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content:
                return _walk(content)
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror}") from error


def _walk(content: mmap.mmap) -> Condition:
    at, size = len(MAGIC), len(content)
    while at + RECORD.size <= size:
        kind, length = RECORD.unpack_from(content, at)
        if kind == DATA_END_KIND and content[size - len(MAGIC) :] == MAGIC:
            footer_at = size - len(MAGIC) - FOOTER_SIZE
            has_index = content[footer_at : footer_at + 8] != bytes(8)
            return Condition(whole=at, size=size, ends=True, has_index=has_index)
        problem = _problem_of_record(content, kind, at + RECORD.size, length)
        if problem:
            break
        at += RECORD.size + length
    else:
        problem = f"{size - at} bytes of a record's header" if at < size else "nothing more"
    return Condition(whole=at, size=size, ends=False, has_index=False, problem=problem)


def _problem_of_record(content: mmap.mmap, kind: int, begin: int, length: int) -> str:
    """Description of a record's damage; empty if it is intact."""
    if kind == DATA_END_KIND:
        return "a truncated index: no message is lost"
    if kind not in KINDS or kind == FOOTER_KIND:
        return "bytes that are not a record"
    if begin + length > len(content):
        return f"{len(content) - begin} of the {length} bytes of a record"
    return _problem_of_chunk(content, begin, length) if kind == CHUNK_KIND else ""


def _problem_of_chunk(content: mmap.mmap, begin: int, length: int) -> str:
    """Description of a chunk's damage; empty if it can be decompressed."""
    content.seek(begin)
    try:
        read_chunk(content, chunk_info(content, begin - RECORD.size, length))
    except Exception as error:  # damaged bytes may raise any exception
        return f"a damaged chunk ({error})"
    return ""


def repair(path: Path, condition: Condition, output: Path, progress: Progress | None = None) -> int:
    """Write the intact messages of a file to a new bag, ordered by time and with an index.

    Args:
        path: The MCAP file; it is not changed.
        condition: Result of :func:`examine`.
        output: The folder to create.
        progress: Called from time to time with the fraction written, 0 to 1.

    Returns:
        The number of messages written.

    Raises:
        InputError: If there is nothing to save, or the new bag cannot be written.
    """
    with tempfile.TemporaryDirectory(prefix="pose_repair_") as folder:
        if condition.ends:
            return _rewrite(path, output, progress)
        closed = Path(folder) / path.name
        _copy_closed(path, condition.whole, closed)
        return _rewrite(closed, output, progress)


def _copy_closed(path: Path, whole: int, copy: Path) -> None:
    with writing(copy), path.open("rb") as source, copy.open("wb") as target:
        left = whole
        while left and (block := source.read(min(left, 1 << 20))):
            target.write(block)
            left -= len(block)
        target.write(END)


def _rewrite(path: Path, output: Path, progress: Progress | None) -> int:
    with open_bag(path) as bag, BagWriter(output, typestore=bag.typestore) as writer:
        for topic in bag.topics.values():
            reliable = [one.reliability != QosReliability.BEST_EFFORT for one in topic.offered]
            depths = [one.depth for one in topic.offered]
            writer.add_topic(
                topic.name,
                topic.msgtype,
                latched=topic.latched,
                reliable=all(reliable),
                depth=max(MIN_DEPTH, *depths) if depths else MIN_DEPTH,
            )
        for batch in bag.batches():
            for connection, stamp_ns, data in batch:
                writer.write_serialized(connection.topic, connection.msgtype, data, stamp_ns)
            if progress is not None:
                progress(bag.share_before(batch[-1].stamp_ns))
        return writer.message_count
