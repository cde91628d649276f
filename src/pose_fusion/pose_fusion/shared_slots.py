"""Memory that a process shares with those it forks: large arrays pass without going through a pipe.

A value is pickled without its arrays' bytes (pickle's protocol 5, PEP 574), which are copied into a
slot of the memory; what is left to be sent is small.
"""

import pickle
from dataclasses import dataclass
from mmap import mmap
from typing import Any

ALIGNMENT = 64  # [bytes] of an array's beginning
ANONYMOUS = -1  # no file: only children that are forked see the memory


@dataclass(frozen=True, kw_only=True)
class Parcel:
    """A value without its arrays' bytes."""

    data: bytes  # pickled
    sizes: tuple[int, ...]  # [bytes] of the arrays, one after the other in the slot


class SharedSlots:
    """Places for a few values.

    Args:
        count: How many of them.
        size: Of each [bytes]; memory is taken only where something is written. The arrays of a
            value that does not fit stay in its pickle.
    """

    def __init__(self, count: int, size: int) -> None:
        self._count = count
        self._size = size
        self._memory = mmap(ANONYMOUS, count * size)

    def pack(self, number: int, value: Any) -> Parcel:
        """Put a value's arrays into the slot of the number, which starts again after the last."""
        arrays: list[pickle.PickleBuffer] = []
        data = pickle.dumps(value, protocol=5, buffer_callback=arrays.append)
        contents = [array.raw() for array in arrays]
        sizes = tuple(content.nbytes for content in contents)
        if sum(map(_aligned, sizes)) > self._size:
            return Parcel(data=pickle.dumps(value, protocol=5), sizes=())
        at = self._begin(number)
        for content in contents:
            self._memory[at : at + content.nbytes] = content
            at += _aligned(content.nbytes)
        return Parcel(data=data, sizes=sizes)

    def unpack(self, number: int, parcel: Parcel) -> Any:
        """The value again, its arrays' bytes copied: the slot may be used anew."""
        begin = self._begin(number)
        content = bytearray(self._memory[begin : begin + sum(map(_aligned, parcel.sizes))])
        arrays, at = [], 0
        for size in parcel.sizes:
            arrays.append(memoryview(content)[at : at + size])
            at += _aligned(size)
        return pickle.loads(parcel.data, buffers=arrays)

    def _begin(self, number: int) -> int:
        return number % self._count * self._size


def _aligned(size: int) -> int:
    return size + -size % ALIGNMENT
