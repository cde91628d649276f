"""Ring buffers of several IMUs: append samples, interpolate or extrapolate to an instant."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pose_core.arrays import FloatArray
from pose_core.kernels.compiling import compiled_in_place, compiled_into_caller
from pose_core.kernels.interpolation import interpolate, rotated_right
from pose_core.stamps import NS_PER_S

SAMPLES = 512  # stored for each IMU: half a second of the fastest
HISTORY_NS = NS_PER_S  # a larger step back means that a clock was set back
MAX_GAP_NS = 100_000_000  # a longer gap is not interpolated
SLOPE_NS = 20_000_000  # over which the slope of a rate is computed
MAX_SLOPE_NS = 40_000_000  # for which a rate is extrapolated linearly


class ImuRings(NamedTuple):
    """The last samples of each IMU: ``size`` of them, the newest at ``newest``.

    The defaults are the row of one new IMU.
    """

    stamps_ns: NDArray[np.int64] = np.zeros((1, SAMPLES), np.int64)  # (imus, size) [ns]
    orientation: FloatArray = np.zeros((1, SAMPLES, 4))  # (imus, size, 4)
    stddev: FloatArray = np.zeros((1, SAMPLES, 3))  # (imus, size, 3) [rad]
    rate: FloatArray = np.zeros((1, SAMPLES, 3))  # (imus, size, 3) [rad/s]
    newest: NDArray[np.int64] = np.full(1, -1, np.int64)  # (imus,)
    filled: NDArray[np.int64] = np.zeros(1, np.int64)  # (imus,) how many there are


class ImuStates(NamedTuple):
    """State of every IMU at an instant."""

    R_world_sensor: FloatArray  # (imus, 3, 3)
    rate: FloatArray  # (imus, 3) [rad/s]
    stddev: FloatArray  # (imus, 3) [rad]
    known: NDArray[np.bool_]  # (imus,) whether there is a sample nearby
    age_s: FloatArray  # (imus,) [s] of extrapolation, 0 between two samples


@compiled_in_place
def append_samples(
    rings: ImuRings,
    imu: NDArray[np.int64],
    stamps_ns: NDArray[np.int64],
    orientation: FloatArray,
    stddev: FloatArray,
    rate: FloatArray,
    gap_ns: NDArray[np.int64],
) -> int:
    """Append samples to their IMUs' rings; return how many were rejected as out of order.

    ``gap_ns``, shape (imus,), is raised to the longest time between two samples of each.
    """
    size = rings.stamps_ns.shape[1]
    rejected = 0
    for row in range(len(imu)):
        i, stamp_ns = imu[row], stamps_ns[row]
        if rings.filled[i] > 0:
            newest_ns = rings.stamps_ns[i, rings.newest[i]]
            if stamp_ns <= newest_ns:
                if newest_ns - stamp_ns < HISTORY_NS:
                    rejected += 1
                    continue
                rings.filled[i] = 0  # the clock was set back: restart
            else:
                gap_ns[i] = max(gap_ns[i], stamp_ns - newest_ns)
        at = (rings.newest[i] + 1) % size
        rings.stamps_ns[i, at] = stamp_ns
        for k in range(4):
            rings.orientation[i, at, k] = orientation[row, k]
        for axis in range(3):
            rings.stddev[i, at, axis] = stddev[row, axis]
            rings.rate[i, at, axis] = rate[row, axis]
        rings.newest[i] = at
        rings.filled[i] = min(rings.filled[i] + 1, size)
    return rejected


@compiled_in_place
def read_states(rings: ImuRings, order: NDArray[np.int64], stamp_ns: int, out: ImuStates) -> int:
    """Compute every IMU's state at an instant.

    Args:
        rings: The samples.
        order: Row of the ring for each output row, (imus,).
        stamp_ns: The instant.
        out: Filled.

    Returns:
        Number of known states.
    """
    size, count = rings.stamps_ns.shape[1], 0
    for row in range(len(order)):
        i = order[row]
        out.known[row], out.age_s[row] = False, 0.0
        later = 0  # samples at or after the instant
        while later < rings.filled[i]:
            if rings.stamps_ns[i, (rings.newest[i] - later) % size] < stamp_ns:
                break
            later += 1
        before = (rings.newest[i] - later) % size
        after = (before + 1) % size
        has_before, has_after = later < rings.filled[i], later > 0
        if has_before and has_after:
            share = _share(rings, i, before, after, stamp_ns)
            out.known[row] = share >= 0.0
            if out.known[row]:
                _between(rings, i, before, share, out, row)
        elif has_before or has_after:
            nearest = before if has_before else after
            missing_ns = stamp_ns - rings.stamps_ns[i, nearest]
            out.age_s[row] = abs(missing_ns) / NS_PER_S
            out.known[row] = abs(missing_ns) <= MAX_GAP_NS
            if out.known[row]:
                _beyond(rings, i, nearest, missing_ns, out, row)
        count += out.known[row]
    return count


@compiled_into_caller
def _share(rings: ImuRings, i: int, before: int, after: int, stamp_ns: int) -> float:
    """Interpolation share [-] between two samples; −1 if they are too far apart."""
    interval_ns = rings.stamps_ns[i, after] - rings.stamps_ns[i, before]
    if interval_ns > MAX_GAP_NS:
        return -1.0
    return (stamp_ns - rings.stamps_ns[i, before]) / interval_ns


@compiled_into_caller
def _between(rings: ImuRings, i: int, before: int, share: float, out: ImuStates, row: int) -> None:
    """Interpolate between a sample and the next."""
    after = (before + 1) % rings.stamps_ns.shape[1]
    orientation, rate, stddev = rings.orientation[i], out.rate[row], out.stddev[row]
    interpolate(orientation[before], orientation[after], share, out.R_world_sensor[row])
    for axis in range(3):
        rate[axis] = (1.0 - share) * rings.rate[i, before, axis]
        rate[axis] += share * rings.rate[i, after, axis]
        stddev[axis] = rings.stddev[i, after, axis]


@compiled_into_caller
def _beyond(
    rings: ImuRings, i: int, nearest: int, missing_ns: int, out: ImuStates, row: int
) -> None:
    """Extrapolate from the nearest sample: rate linearly, orientation by its integral."""
    size = rings.stamps_ns.shape[1]
    earlier, per_s = nearest, 0.0  # the sample that the rate's slope is taken from
    if missing_ns > 0:
        for back in range(1, rings.filled[i]):
            one = (nearest - back) % size
            interval_ns = rings.stamps_ns[i, nearest] - rings.stamps_ns[i, one]
            if interval_ns > MAX_SLOPE_NS:
                break
            if interval_ns >= SLOPE_NS:
                earlier, per_s = one, NS_PER_S / interval_ns
                break
    missing_s = missing_ns / NS_PER_S
    sloping_s = min(missing_ns, MAX_SLOPE_NS) / NS_PER_S
    last, rate, stddev = rings.rate[i, nearest], out.rate[row], out.stddev[row]
    for axis in range(3):
        slope = (last[axis] - rings.rate[i, earlier, axis]) * per_s
        rate[axis] = last[axis] + slope * sloping_s
        stddev[axis] = rings.stddev[i, nearest, axis]
    # The integral of a rate that changes linearly at first and is then constant.
    x = rate[0] * missing_s - (rate[0] - last[0]) * 0.5 * sloping_s
    y = rate[1] * missing_s - (rate[1] - last[1]) * 0.5 * sloping_s
    z = rate[2] * missing_s - (rate[2] - last[2]) * 0.5 * sloping_s
    rotated_right(rings.orientation[i, nearest], x, y, z, out.R_world_sensor[row])
