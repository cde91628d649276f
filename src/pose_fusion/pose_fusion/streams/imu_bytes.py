"""IMUs' orientations from the bytes of ``sensor_msgs/Imu``, many messages at once."""

from collections import defaultdict
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from pose_common.errors import InputError
from pose_fusion.streams.cdr_layout import Walker, byte_rows, numbers, stamps
from pose_fusion.streams.samples import FloatArray, ImuBlock

WHAT = "sensor_msgs/msg/Imu"
FRAME_LENGTH = slice(12, 16)  # [bytes] where the length of the frame's name stands
NUMBERS = 37  # orientation, rate, acceleration, and their covariances
ORIENTATION, RATE = slice(0, 4), slice(13, 16)
VARIANCE = [4, 8, 12]  # the diagonal of the orientation's covariance
FASTEST_RATE = 200.0  # [rad/s] no gyroscope measures as much, per axis


def imu_block(datas: Mapping[str, Sequence[bytes]]) -> tuple[ImuBlock, NDArray[np.intp]]:
    """Messages as rows, one segment's after the other's, each in the order given.

    Args:
        datas: Serialised messages by segment.

    Returns:
        The rows, and which messages they are, counted through all segments: those that say no
        orientation are left out, and those whose rates or variances are no numbers.
    """
    every = [data for of_one in datas.values() for data in of_one]
    imu = np.repeat(np.arange(len(datas)), [len(of_one) for of_one in datas.values()])
    alike: dict[tuple[int, bytes], list[int]] = defaultdict(list)
    for index, data in enumerate(every):
        # All that decides where the numbers lie is the length of the frame's name.
        alike[len(data), data[FRAME_LENGTH] + data[1:2]].append(index)
    values = np.empty((len(every), NUMBERS))
    stamps_ns = np.zeros(len(every), np.int64)
    for indices in alike.values():
        values[indices], stamps_ns[indices] = _same_form([every[i] for i in indices])
    kept = np.flatnonzero(_says_something(values))
    values = values[kept]
    block = ImuBlock(
        segments=tuple(datas),
        imu=imu[kept],
        stamps_ns=stamps_ns[kept],
        orientation=np.ascontiguousarray(values[:, ORIENTATION]),
        orientation_stddev=np.sqrt(np.maximum(values[:, VARIANCE], 0.0)),
        angular_velocity=np.ascontiguousarray(values[:, RATE]),
    )
    return block, kept


def _same_form(datas: list[bytes]) -> tuple[FloatArray | float, NDArray[np.int64] | int]:
    """The numbers, (n, 37), and stamps [ns] of messages of one form; NaN where they are none."""
    try:
        walker = Walker(datas[0], WHAT)
        walker.skip(4, 2)
        walker.skip(1, walker.length())
        at = walker.skip(8, NUMBERS)
    except InputError:
        return np.nan, 0
    rows = byte_rows(datas)
    return numbers(rows, at, NUMBERS, f"{walker.order}f8"), stamps(rows, 0, walker.order)


def _says_something(values: FloatArray) -> NDArray[np.bool_]:
    """Whether each row has an orientation, and numbers that can be."""
    with np.errstate(invalid="ignore", over="ignore"):
        length = np.sqrt((values[:, ORIENTATION] ** 2).sum(axis=1))
        # REP 145: a first element of −1 says that there is no orientation.
        has_orientation = (values[:, VARIANCE[0]] != -1.0) & (length > 0.9) & (length < 1.1)
        is_known = np.isfinite(values[:, VARIANCE]).all(axis=1)
        is_known &= (np.abs(values[:, RATE]) < FASTEST_RATE).all(axis=1)
        return np.asarray(has_orientation & is_known)
