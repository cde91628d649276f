"""IMUs' orientations from the bytes of ``sensor_msgs/Imu``, many messages at once."""

from collections import defaultdict
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pose_common.errors import InputError
from pose_fusion.streams.cdr_layout import ByteRows, Walker, byte_rows, numbers, stamps
from pose_fusion.streams.samples import FloatArray, ImuBlock, joined

WHAT = "sensor_msgs/msg/Imu"
NUMBERS = 37  # orientation, rate, acceleration, and their covariances
ORIENTATION, RATE = slice(0, 4), slice(13, 16)
VARIANCE = [4, 8, 12]  # the diagonal of the orientation's covariance
FASTEST_RATE = 200.0  # [rad/s] no gyroscope measures as much, per axis


def imu_block(datas: Sequence[bytes], segment: str) -> tuple[ImuBlock, NDArray[np.intp]]:
    """One segment's messages as rows, in the order given.

    Args:
        datas: Serialised messages.
        segment: Whose they are.

    Returns:
        The rows, and which messages they are: those that say no orientation are left out, and
        those whose rates or variances are no numbers.
    """
    if not datas:
        return joined([]), np.zeros(0, np.intp)
    by_length: dict[int, list[int]] = defaultdict(list)
    for index, data in enumerate(datas):
        by_length[len(data)].append(index)
    blocks, places = [], []
    for indices in by_length.values():
        block, kept = _same_length([datas[i] for i in indices], segment)
        blocks.append(block)
        places.append(np.array(indices, np.intp)[kept])
    if len(blocks) == 1:
        return blocks[0], places[0]
    place = np.concatenate(places)
    order = np.argsort(place)
    return joined(blocks).rows(order), place[order]


def _same_length(datas: list[bytes], segment: str) -> tuple[ImuBlock, NDArray[np.intp]]:
    try:
        walker = Walker(datas[0], WHAT)
        walker.skip(4, 2)
        walker.string()
        at = walker.skip(8, NUMBERS)
    except InputError:
        return joined([]), np.zeros(0, np.intp)
    rows = byte_rows(datas)
    values = numbers(rows, at, NUMBERS, f"{walker.order}f8")
    # Texts of other lengths could, with other padding, make messages of the same length.
    alike = (rows[:, walker.fixed] == rows[0, walker.fixed]).all(axis=1)
    kept = np.flatnonzero(alike & _says_something(values))
    return _block(rows[kept], values[kept], segment, walker.order), kept


def _says_something(values: FloatArray) -> NDArray[np.bool_]:
    """Whether each row has an orientation, and numbers that can be."""
    with np.errstate(invalid="ignore", over="ignore"):
        length = np.sqrt((values[:, ORIENTATION] ** 2).sum(axis=1))
        # REP 145: a first element of −1 says that there is no orientation.
        has_orientation = (values[:, VARIANCE[0]] != -1.0) & (length > 0.9) & (length < 1.1)
        is_known = np.isfinite(values[:, VARIANCE]).all(axis=1)
        is_known &= (np.abs(values[:, RATE]) < FASTEST_RATE).all(axis=1)
        return np.asarray(has_orientation & is_known)


def _block(rows: ByteRows, values: FloatArray, segment: str, order: str) -> ImuBlock:
    return ImuBlock(
        segments=(segment,),
        imu=np.zeros(len(rows), np.int64),
        stamps_ns=stamps(rows, 0, order),
        orientation=values[:, ORIENTATION].astype(float),
        orientation_stddev=np.sqrt(np.maximum(values[:, VARIANCE], 0.0)),
        angular_velocity=values[:, RATE].astype(float),
    )
