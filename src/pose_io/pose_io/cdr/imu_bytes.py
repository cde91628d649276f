"""IMUs' samples from the bytes of ``sensor_msgs/Imu``, many messages at once."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from pose_core.api import ImuBlock
from pose_core.kernels.compiling import type_specialised
from pose_io.cdr.kernels import read_imus

_read_imus = type_specialised(read_imus)


def imu_block(datas: Mapping[str, Sequence[bytes]]) -> tuple[ImuBlock, NDArray[np.intp]]:
    """Read messages as rows, segment after segment, each in the order given.

    Args:
        datas: Serialised messages by segment.

    Returns:
        The rows, and the indices of their messages, counted over all segments, shape (n,).
        Messages without an orientation or with variances that are NaN are left out.
    """
    every = [data for of_one in datas.values() for data in of_one]
    count = len(every)
    block = ImuBlock(
        segments=tuple(datas),
        imu=np.repeat(np.arange(len(datas)), [len(of_one) for of_one in datas.values()]),
        stamps_ns=np.empty(count, np.int64),
        orientation=np.empty((count, 4)),
        orientation_stddev=np.empty((count, 3)),
        angular_velocity=np.empty((count, 3)),
        linear_acceleration=np.empty((count, 3)),
    )
    says_something = np.empty(count, np.bool_)
    _read_imus(
        np.frombuffer(b"".join(every), np.uint8),
        np.cumsum([len(data) for data in every], dtype=np.int64),
        block.stamps_ns,
        block.orientation,
        block.orientation_stddev,
        block.angular_velocity,
        block.linear_acceleration,
        says_something,
    )
    kept = np.flatnonzero(says_something)
    return block if len(kept) == count else block.rows(kept), kept
