"""Sampling times of IMUs whose samples arrive in bursts and are stamped on arrival.

Bluetooth delivers the samples of several periods at once. Stamped on arrival, they are a fraction
of a millisecond apart, and then tens of milliseconds; a gyroscope can't be integrated over such
times. A sample is taken one period after the one before, but not after its arrival: the last of a
burst arrives without delay. If the last ones of some bursts all seem to have been delayed, samples
have been lost, and the next is taken later by the least of these delays. Evenly stamped samples are
left as they are.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pose_core.arrays import FloatArray
from pose_core.imu.imu_rows import ImuRows
from pose_core.kernels.compiling import compiled_in_place, compiled_into_caller, type_specialised
from pose_core.streams.samples import ImuBlock

MAX_BURST_NS = 250e6  # [ns] a longer pause is a silence
MEMORY = 200.0  # [-] intervals of the running means
CLOSE = 0.3  # [periods] shorter intervals are within a burst
BURST_SHARE = 0.3  # [-] of intervals within bursts, from which on the samples come in bursts
BURSTS = 3.0  # [-] whose last samples show how far the sampling times are behind
MAX_DELAY_NS = 100e6  # [ns] of a sample in a burst


class _BurstMemory(NamedTuple):
    """Memory of each IMU, from sample to sample; the defaults are the row of a new one."""

    arrival_ns: NDArray[np.int64] = np.zeros(1, np.int64)  # last stamp as it came; 0: none
    sampled_ns: FloatArray = np.zeros(1)  # [ns] since that of ``begin_ns``
    begin_ns: NDArray[np.int64] = np.zeros(1, np.int64)  # stamp of the first sample
    intervals: FloatArray = np.zeros(1)  # number of intervals, up to :data:`MEMORY`
    period_ns: FloatArray = np.zeros(1)  # running mean of the intervals
    share: FloatArray = np.zeros(1)  # [-] running share of intervals within bursts
    behind_ns: FloatArray = np.zeros(1)  # least delay of the last samples of ``bursts`` bursts
    bursts: FloatArray = np.zeros(1)  # number, up to :data:`BURSTS`


class BurstStamps:
    """Restores the stamps of IMUs whose samples come in bursts."""

    def __init__(self) -> None:
        self._rows = ImuRows(_BurstMemory())
        self._restore = type_specialised(restore_stamps)

    @property
    def in_bursts(self) -> frozenset[str]:
        """Segments whose IMU's samples come in bursts."""
        is_in_bursts = self._rows.memory.share > BURST_SHARE
        return frozenset(self._rows.named(is_in_bursts)) if is_in_bursts.any() else frozenset()

    def restored(self, block: ImuBlock) -> ImuBlock:
        """The block with sampling times instead of times of arrival, where they come in bursts."""
        imu, stamps_ns = self._rows.of(block), np.array(block.stamps_ns)
        if not self._restore(self._rows.memory, imu, stamps_ns):
            return block
        return replace(block, stamps_ns=stamps_ns)


@compiled_in_place
def restore_stamps(
    memory: _BurstMemory, imu: NDArray[np.int64], stamps_ns: NDArray[np.int64]
) -> bool:
    """Restore stamps one after the other; whether any has changed.

    Args:
        memory: Memory of the IMUs; updated.
        imu: Index of each sample's IMU, (n,).
        stamps_ns: Times of arrival, replaced by sampling times, (n,).
    """
    has_changed = False
    for row in range(len(imu)):
        i = imu[row]
        since_ns = float(stamps_ns[row] - memory.arrival_ns[i])
        is_first = memory.arrival_ns[i] == 0
        if not is_first and -MAX_BURST_NS < since_ns < 0.0:
            continue
        memory.arrival_ns[i] = stamps_ns[row]
        if is_first or abs(since_ns) > MAX_BURST_NS:
            memory.begin_ns[i], memory.sampled_ns[i] = stamps_ns[row], 0.0
            continue
        memory.intervals[i] = min(memory.intervals[i] + 1.0, MEMORY)
        is_close = since_ns < CLOSE * memory.period_ns[i]
        memory.period_ns[i] += (since_ns - memory.period_ns[i]) / memory.intervals[i]
        memory.share[i] += (is_close - memory.share[i]) / memory.intervals[i]
        arrived_ns = float(stamps_ns[row] - memory.begin_ns[i])
        if memory.share[i] <= BURST_SHARE:
            memory.sampled_ns[i] = arrived_ns
            continue
        sampled_ns = memory.sampled_ns[i] + memory.period_ns[i]
        if not is_close:
            sampled_ns += lost_time(memory, i, arrived_ns - since_ns - memory.sampled_ns[i])
        memory.sampled_ns[i] = min(max(sampled_ns, arrived_ns - MAX_DELAY_NS), arrived_ns)
        stamps_ns[row] = memory.begin_ns[i] + np.int64(memory.sampled_ns[i])
        has_changed = True
    return has_changed


@compiled_into_caller
def lost_time(memory: _BurstMemory, i: int, delay_ns: float) -> float:
    """Time [ns] by which the sampling times are behind, after every few bursts; otherwise 0.

    Args:
        memory: Memory of the IMUs; updated.
        i: The IMU.
        delay_ns: Delay of a burst's last sample [ns].
    """
    is_first = memory.bursts[i] == 0.0
    memory.behind_ns[i] = delay_ns if is_first else min(memory.behind_ns[i], delay_ns)
    memory.bursts[i] += 1.0
    if memory.bursts[i] < BURSTS:
        return 0.0
    memory.bursts[i] = 0.0
    return memory.behind_ns[i]
