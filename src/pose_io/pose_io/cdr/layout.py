"""Offsets of the numbers in a serialised message of skeletons, found in one pass over its bytes.

CDR (OMG DDSI-RTPS, plain encoding): four bytes of encapsulation, the second gives the byte order;
then every number is aligned to its size, counted from there. A string or a sequence begins with
its length, four bytes.
"""

from struct import Struct

import numpy as np

from pose_core.errors import InputError
from pose_io.cdr.kernels import HEADER_SIZE
from pose_io.names import SKELETON_ARRAY


class Walker:
    """Reads a message field by field.

    Args:
        data: The message's bytes.

    Raises:
        InputError: If there are too few bytes for any message.
    """

    def __init__(self, data: bytes) -> None:
        if len(data) < HEADER_SIZE:
            raise InputError(
                f"a {SKELETON_ARRAY} has {len(data)} bytes: expected a serialised message"
            )
        self._body = memoryview(data)[HEADER_SIZE:]
        self.order = "<" if data[1] & 1 else ">"
        self._length = Struct(f"{self.order}I")
        self.at = 0
        self.fixed = np.zeros(len(self._body), np.bool_)  # bytes of strings and lengths

    def skip(self, size: int, count: int = 1) -> int:
        """Skip numbers of ``size`` bytes; returns the offset of the first.

        Raises:
            InputError: If the message ends before.
        """
        start = self.at + -self.at % size if count else self.at
        self.at = start + size * count
        if self.at > len(self._body):
            raise InputError(
                f"a {SKELETON_ARRAY} ends after {len(self._body)} bytes: expected {self.at} or more"
            )
        return start

    def length(self) -> int:
        """Read the length of a string or a sequence."""
        start = self.skip(4)
        self.fixed[start : self.at] = True
        (value,) = self._length.unpack_from(self._body, start)
        return int(value)

    def string(self) -> str:
        """Read a string.

        Raises:
            InputError: If it is not UTF-8, or the message ends before.
        """
        size = self.length()
        start = self.skip(1, size)
        self.fixed[start : self.at] = True
        try:
            return bytes(self._body[start : self.at]).rstrip(b"\0").decode()
        except UnicodeDecodeError as error:
            raise InputError(
                f"a {SKELETON_ARRAY} contains a string that is not UTF-8: {error}"
            ) from error
