r"""Measures how far each IMU's heading walks, as in a disturbed magnetic field.

The heading changes against the gyroscope by :math:`\delta` in a second. A gyroscope's bias gives
:math:`\delta` its mean, and what moves to and fro under the strap does not add up. A walk does: the
variance of the change within n seconds grows by :math:`w^2` for each second,

.. math:: w^2 = (\operatorname{var} \delta_4 - \operatorname{var} \delta_1) / 3

The times between samples that come in bursts are uncertain where some are lost. Of their changes,
the part about the axis of the turn does not count, since a wrong time gives just this.
"""

from collections.abc import Mapping, Set
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pose_core.arrays import FloatArray
from pose_core.imu.imu_rows import ImuRows
from pose_core.imu.orientation_check import MAX_STEP_S
from pose_core.kernels.compiling import compiled_in_place, compiled_into_caller, type_specialised
from pose_core.kernels.quaternions import Quaternion, integrated_orientation, quaternion_product
from pose_core.stamps import NS_PER_S
from pose_core.streams.samples import ImuBlock

LONG = 4  # [s]
KEPT = float(np.exp(-1.0 / 60.0))  # [-] of the sums after a second
MAX_CHANGE = 0.5  # [rad] in a second; more is a fault of the device or of its stamps
SOUND = np.radians(1.5)  # [rad/√s] walk of most IMUs in an undisturbed field, at most
DISTURBED = np.radians(2.5)  # [rad/√s] from which on the field is named


class _WalkMemory(NamedTuple):
    """Memory of each IMU; the defaults are the row of a new one."""

    stamp_ns: NDArray[np.int64] = np.zeros(1, np.int64)  # of the last sample; 0: none
    orientation: FloatArray = np.zeros((1, 4))  # of the last sample
    rate: FloatArray = np.zeros((1, 3))  # [rad/s] of the last sample
    heading: FloatArray = np.zeros(1)  # [rad] against the gyroscope
    since_s: FloatArray = np.zeros(1)  # [s] since the last second began
    seconds: NDArray[np.int64] = np.zeros(1, np.int64)  # number of complete seconds
    past: FloatArray = np.zeros((1, LONG + 1))  # heading at each second, the last one first
    short: FloatArray = np.zeros((1, 3))  # weight, sum, sum of squares of a second's changes
    long: FloatArray = np.zeros((1, 3))  # the same of those in ``LONG`` seconds
    variance: FloatArray = np.zeros(1)  # [rad²/s] of the walk


class HeadingWalks:
    """The walk of each IMU's heading."""

    def __init__(self) -> None:
        self._rows = ImuRows(_WalkMemory())
        self._watch_samples = type_specialised(watch_samples)
        self.unsound: Mapping[str, float] = {}
        """Walks [rad/√s] that are larger than in an undisturbed field, by segment."""

    @property
    def disturbed(self) -> Mapping[str, float]:
        """Walks [rad/√s] of the IMUs whose magnetic field is disturbed, by segment."""
        return {segment: walk for segment, walk in self.unsound.items() if walk > DISTURBED}

    def add(self, block: ImuBlock, in_bursts: Set[str] = frozenset()) -> None:
        """Take samples into account; of some segments' IMUs, they come in bursts."""
        imu = self._rows.of(block)
        is_in_bursts = np.zeros(len(self._rows.segments), np.bool_)
        if in_bursts:
            is_in_bursts[:] = [name in in_bursts for name in self._rows.segments]
        has_changed = self._watch_samples(
            self._rows.memory,
            imu,
            block.stamps_ns,
            block.orientation,
            block.angular_velocity,
            is_in_bursts,
        )
        if has_changed:
            variance = self._rows.memory.variance
            walks = np.where(variance > SOUND**2, np.sqrt(variance), 0.0)
            self.unsound = self._rows.named(walks)


@compiled_in_place
def watch_samples(
    memory: _WalkMemory,
    imu: NDArray[np.int64],
    stamps_ns: NDArray[np.int64],
    orientation: FloatArray,
    rate: FloatArray,
    is_in_bursts: NDArray[np.bool_],
) -> bool:
    """Take samples into account, one after the other; whether a second ended, as walks then change.

    Args:
        memory: Memory of the IMUs; updated.
        imu: Index of each sample's IMU, (n,).
        stamps_ns: (n,).
        orientation: (n, 4), x y z w.
        rate: (n, 3) [rad/s].
        is_in_bursts: Whether samples of each IMU come in bursts, (imus,).
    """
    has_changed = False
    for row in range(len(imu)):
        i = imu[row]
        dt_s = (stamps_ns[row] - memory.stamp_ns[i]) / NS_PER_S
        if dt_s == 0.0:
            continue  # a repeated stamp: the next sample's change covers both
        if dt_s > MAX_STEP_S:
            memory.seconds[i], memory.since_s[i] = 0, 0.0
        elif dt_s > 0.0:
            before = memory.orientation[i]
            x, y, z, w = integrated_orientation(before, memory.rate[i], rate[row], dt_s)
            a, b, c, d = orientation[row]
            change = quaternion_product((a, b, c, d), (-x, -y, -z, w))
            a, b, c, d = before
            turn = quaternion_product((x, y, z, w), (-a, -b, -c, d))
            up = without_part_along(change, turn) if is_in_bursts[i] else change[2]
            memory.heading[i] += 2.0 * up if change[3] > 0.0 else -2.0 * up
            memory.since_s[i] += dt_s
            if memory.since_s[i] >= 1.0:
                memory.since_s[i] -= 1.0
                end_second(memory, i)
                has_changed = True
        memory.stamp_ns[i] = stamps_ns[row]
        for k in range(4):
            memory.orientation[i, k] = orientation[row, k]
        for k in range(3):
            memory.rate[i, k] = rate[row, k]
    return has_changed


@compiled_into_caller
def without_part_along(change: Quaternion, turn: Quaternion) -> float:
    """Vertical part of a change [half rad] without what is about the axis of a turn."""
    power = turn[0] ** 2 + turn[1] ** 2 + turn[2] ** 2
    if power == 0.0:
        return change[2]
    along = change[0] * turn[0] + change[1] * turn[1] + change[2] * turn[2]
    return change[2] - along * turn[2] / power


@compiled_into_caller
def end_second(memory: _WalkMemory, i: int) -> None:
    """Update the walk of one IMU at the end of a second."""
    past, short, long = memory.past[i], memory.short[i], memory.long[i]
    for k in range(LONG, 0, -1):
        past[k] = past[k - 1]
    past[0] = memory.heading[i]
    memory.seconds[i] += 1
    if abs(past[0] - past[1]) > MAX_CHANGE:
        memory.seconds[i] = 0
    if memory.seconds[i] > 1:
        add_change(short, past[0] - past[1])
    if memory.seconds[i] > LONG:
        add_change(long, past[0] - past[LONG])
        mean = short[1] / short[0]
        grown = variance_about(long, LONG * mean) - variance_about(short, mean)
        memory.variance[i] = max(0.0, grown / (LONG - 1))


@compiled_into_caller
def add_change(sums: FloatArray, change: float) -> None:
    """Add a change of the heading [rad] to weight, sum and sum of squares, (3,)."""
    for k in range(3):
        sums[k] = KEPT * sums[k] + change**k


@compiled_into_caller
def variance_about(sums: FloatArray, mean: float) -> float:
    """Mean square about a mean [rad²] of changes whose sums are given, (3,)."""
    return (sums[2] - 2.0 * mean * sums[1]) / sums[0] + mean**2
