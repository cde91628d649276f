"""Serialised messages of which only the numbers change: numbers are overwritten in place.

A message whose strings and sequences have constant lengths has its numbers at constant offsets.
The offsets are found once, by the rules of CDR (OMG DDSI-RTPS, plain little-endian encoding: every
number aligned to its size, counted from after the four bytes of the encapsulation header).
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from rosbags.interfaces import Nodetype
from rosbags.typesys.store import Typestore

from pose_core.arrays import FloatArray
from pose_core.kernels.compiling import type_specialised
from pose_io.arrays import BoolArray, ByteArray, IntArray
from pose_io.cdr.kernels import HEADER_SIZE, NumberPlaces, fill_rows

MARGIN = 4  # [bytes] before the encapsulation
TIME = "builtin_interfaces/msg/Time"
SIZES = {
    **dict.fromkeys(("bool", "byte", "char", "int8", "uint8"), 1),
    **dict.fromkeys(("int16", "uint16"), 2),
    **dict.fromkeys(("int32", "uint32", "float32"), 4),
    **dict.fromkeys(("int64", "uint64", "float64"), 8),
}


class MessageTemplate:
    """One message's bytes and the offsets of its numbers.

    Args:
        message: A rosbags message; its strings and the lengths of its sequences are kept.
        typestore: Definitions of the messages.

    Raises:
        ValueError: If rosbags lays the message out in another way.
    """

    def __init__(self, message: Any, typestore: Typestore) -> None:
        self._typestore = typestore
        self._fill = type_specialised(fill_rows)
        self._found: dict[str, list[int]] = {kind: [] for kind in NumberPlaces._fields}  # [bytes]
        end = self._walk_message(message, 0)
        data = typestore.serialize_cdr(message, message.__msgtype__)
        if len(data) != HEADER_SIZE + end:
            raise ValueError(
                f"{message.__msgtype__} has {len(data)} bytes, not {HEADER_SIZE + end}"
            )
        # The numbers begin where every size fits: four bytes stand before the encapsulation.
        row = np.zeros(MARGIN + HEADER_SIZE + end + -end % 8, np.uint8)
        row[MARGIN : MARGIN + len(data)] = np.frombuffer(data, np.uint8)
        self._row, self._end = row, MARGIN + len(data)
        sizes = {"stamps": 4, "float64": 8, "float32": 4, "uint8": 1}
        self._places = NumberPlaces(
            **{
                kind: (MARGIN + HEADER_SIZE + np.array(self._found[kind], int)) // size
                for kind, size in sizes.items()
            }
        )

    def change_only(self, float64: BoolArray, float32: BoolArray) -> None:
        """Select the numbers that :meth:`fill` replaces, masks of shapes (k,) and (l,)."""
        places = self._places
        self._places = places._replace(
            float64=places.float64[float64], float32=places.float32[float32]
        )

    @property
    def float64(self) -> FloatArray:
        """The message's float64 numbers, in the order of its fields."""
        return self._row.view("<f8")[self._places.float64]

    @property
    def float32(self) -> NDArray[np.float32]:
        """The message's float32 numbers, in the order of its fields."""
        return self._row.view("<f4")[self._places.float32]

    def fill(
        self,
        stamps_ns: IntArray,
        float64: FloatArray,
        float32: NDArray[np.float32] | None = None,
        uint8: ByteArray | None = None,
    ) -> ByteArray:
        """The bytes of n messages with other numbers, shape (n, bytes).

        Args:
            stamps_ns: Stamp of every header whose stamp is not zero [ns], shape (n,).
            float64: The float64 numbers, in the order of the fields, shape (n, k).
            float32: The float32 numbers, shape (n, l); None leaves them.
            uint8: The bytes, shape (n, m); None leaves them.

        Raises:
            ValueError: If there are more or fewer numbers than places for them.
        """
        count = len(stamps_ns)
        # The kernel does not check array bounds.
        own = self._places
        given = ((float64, own.float64), (float32, own.float32), (uint8, own.uint8))
        for numbers, places in given:
            if numbers is not None and numbers.shape != (count, len(places)):
                raise ValueError(f"found {numbers.shape} numbers: expected {(count, len(places))}")
        rows = np.empty((count, len(self._row)), np.uint8)
        self._fill(
            self._row,
            own,
            stamps_ns,
            float64,
            np.empty((count, 0), np.float32) if float32 is None else float32,
            np.empty((count, 0), np.uint8) if uint8 is None else uint8,
            rows,
        )
        return rows[:, MARGIN : self._end]

    def _walk_message(self, message: Any, at: int) -> int:
        """Store the offsets of a message's numbers; returns its end."""
        msgtype = message.__msgtype__
        if msgtype == TIME and (message.sec or message.nanosec):  # zero means no stamp
            self._found["stamps"].append(at + -at % 4)
        for name, description in self._typestore.fielddefs[msgtype][1]:
            at = self._walk(getattr(message, name), description, at)
        return at

    def _walk(self, value: Any, description: Any, at: int) -> int:
        kind, detail = description
        if kind == Nodetype.NAME:
            return self._walk_message(value, at)
        if kind == Nodetype.BASE:
            return self._walk_base(value, detail[0], at)
        element, _ = detail  # an array or a sequence
        if kind == Nodetype.SEQUENCE:
            at += -at % 4 + 4
        for item in value:
            at = self._walk(item, element, at)
        return at

    def _walk_base(self, value: Any, name: str, at: int) -> int:
        if name == "string":
            return at + -at % 4 + 4 + len(value.encode()) + 1
        size = SIZES[name]
        at += -at % size
        if name in self._found:
            self._found[name].append(at)
        return at + size
