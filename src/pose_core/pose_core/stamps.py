"""Stamps are integer nanoseconds; seconds occur only as differences."""

import struct
from typing import Any

NS_PER_S = 1_000_000_000
NS_PER_US = 1_000
JUMP_BACK_NS = NS_PER_S  # [ns] a larger step back means that a recording has restarted
CDR_STAMP = struct.Struct("<iI")  # little endian
CDR_STAMP_AT = 4  # [bytes] behind the encapsulation


def nanoseconds(stamp: Any) -> int:
    """Nanoseconds of a message's stamp, of ROS or of rosbags."""
    return int(stamp.sec) * NS_PER_S + int(stamp.nanosec)


def newest_of(newest_ns: int, stamp_ns: int) -> int:
    """The later of two stamps [ns]; ``stamp_ns`` if it is set back, as where a recording loops."""
    return stamp_ns if stamp_ns < newest_ns - JUMP_BACK_NS else max(newest_ns, stamp_ns)


def serialized_ns(data: bytes) -> int:
    """Nanoseconds of the stamp of a serialised message that begins with a header."""
    seconds, rest = CDR_STAMP.unpack_from(data, CDR_STAMP_AT)
    return int(seconds) * NS_PER_S + int(rest)


def put_serialized_ns(data: bytearray, stamp_ns: int) -> None:
    """Replace the stamp of such a message [ns]."""
    CDR_STAMP.pack_into(data, CDR_STAMP_AT, *divmod(stamp_ns, NS_PER_S))
