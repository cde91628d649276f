"""A memory that holds one row for each IMU, in the order in which IMUs appear."""

from collections.abc import Callable
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from pose_core.streams.samples import ImuBlock

Memory = TypeVar("Memory", bound="tuple[NDArray[np.generic], ...]")


class ImuRows(Generic[Memory]):
    """The memory, and whose each row is.

    Args:
        make: Makes the rows of so many new IMUs, a named tuple of arrays, (imus, ...).
    """

    def __init__(self, make: Callable[[int], Memory]) -> None:
        self.segments: list[str] = []
        self.memory = make(0)
        self._make = make

    def of(self, block: ImuBlock) -> NDArray[np.int64]:
        """Row of each sample's IMU, (n,); IMUs that are new get one."""
        if block.segments == tuple(self.segments):  # as usual
            return np.ascontiguousarray(block.imu)
        new = [name for name in block.segments if name not in self.segments]
        if new:
            self.segments += new
            pairs = zip(self.memory, self._make(len(new)), strict=True)
            self.memory = type(self.memory)(*(np.concatenate(pair) for pair in pairs))
        rows = np.array([self.segments.index(name) for name in block.segments], np.int64)
        return rows[block.imu]

    def named(self, values: NDArray[Any]) -> dict[str, Any]:
        """Values of the IMUs, (imus,), that are not 0, by segment."""
        found = zip(self.segments, values.tolist(), strict=True)
        return {segment: value for segment, value in found if value}
