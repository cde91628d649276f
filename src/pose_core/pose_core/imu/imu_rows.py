"""Rows of a memory that holds one row for each IMU, in the order in which IMUs appear."""

from collections.abc import Callable
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from pose_core.streams.samples import ImuBlock

Memory = TypeVar("Memory", bound="tuple[NDArray[np.generic], ...]")


def rows_of_block(
    block: ImuBlock, segments: list[str], memory: Memory, make: Callable[[int], Memory]
) -> tuple[Memory, NDArray[np.int64]]:
    """Add a row for each IMU that is new.

    Args:
        block: n samples.
        segments: Whose each row is; extended.
        memory: A named tuple of arrays, (imus, ...).
        make: Makes the rows of so many new IMUs.

    Returns:
        The memory, and the row of each sample's IMU, (n,).
    """
    if block.segments == tuple(segments):  # as usual
        return memory, np.ascontiguousarray(block.imu)
    new = [name for name in block.segments if name not in segments]
    if new:
        segments += new
        pairs = zip(memory, make(len(new)), strict=True)
        memory = type(memory)(*(np.concatenate(pair) for pair in pairs))
    rows = np.array([segments.index(name) for name in block.segments], np.int64)
    return memory, rows[block.imu]
