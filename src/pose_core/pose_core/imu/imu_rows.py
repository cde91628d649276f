"""A memory that holds one row for each IMU, in the order in which IMUs appear."""

from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from pose_core.streams.samples import ImuBlock

Memory = TypeVar("Memory", bound="tuple[NDArray[np.generic], ...]")


class ImuRows(Generic[Memory]):
    """Memory of several IMUs, and the segment of each row.

    Args:
        new: The row of a new IMU, a named tuple of arrays, (1, ...).
    """

    def __init__(self, new: Memory) -> None:
        self.segments: list[str] = []
        self.memory = type(new)(*(array[:0] for array in new))
        self._new = new

    def of(self, block: ImuBlock) -> NDArray[np.int64]:
        """Row of each sample's IMU, (n,); IMUs that are new get one."""
        if block.segments == tuple(self.segments):  # as usual
            return block.imu
        for name in block.segments:
            if name not in self.segments:
                self.segments.append(name)
                pairs = zip(self.memory, self._new, strict=True)
                self.memory = type(self._new)(*map(np.concatenate, pairs))
        rows = np.array([self.segments.index(name) for name in block.segments], np.int64)
        return rows[block.imu]

    def named(self, values: NDArray[Any]) -> dict[str, Any]:
        """Values of the IMUs, (imus,), that are not 0, by segment."""
        found = zip(self.segments, values.tolist(), strict=True)
        return {segment: value for segment, value in found if value}
