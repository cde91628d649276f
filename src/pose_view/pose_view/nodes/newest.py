"""Storage of the newest message of each kind as bytes, decoded only when it is drawn.

A person's transforms arrive at the rate of all cameras' frames and take a millisecond to decode;
only the last of them is drawn.
"""

import struct
from collections.abc import Callable
from typing import Any

from rclpy.serialization import deserialize_message

LENGTH = struct.Struct("<I")
FIRST_FRAME_AT = 16  # [bytes] after the encapsulation, the number of transforms and a stamp


class Newest:
    """The newest message of each kind, not decoded yet."""

    def __init__(self) -> None:
        self._waiting: dict[str, tuple[type, bytes, Callable[[Any], None]]] = {}

    def put(self, key: str, kind: type, data: bytes, take: Callable[[Any], None]) -> None:
        """Store a message, which replaces the previous one of the same key."""
        self._waiting[key] = kind, data, take

    def hand_over(self) -> None:
        """Decode the stored messages and pass them to their callbacks, in the order of the keys."""
        waiting, self._waiting = self._waiting, {}
        for key in sorted(waiting):
            kind, data, take = waiting[key]
            take(deserialize_message(data, kind))


def first_child(data: bytes) -> str:
    """The child frame of a serialised ``TFMessage``'s first transform; empty if it has none."""
    try:
        parent_size = LENGTH.unpack_from(data, FIRST_FRAME_AT)[0]
        at = FIRST_FRAME_AT + LENGTH.size + parent_size
        at += -at % LENGTH.size
        child_size = LENGTH.unpack_from(data, at)[0]
        return data[at + LENGTH.size : at + LENGTH.size + child_size - 1].decode()
    except (struct.error, UnicodeDecodeError):
        return ""
