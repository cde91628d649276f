r"""What n IMUs felt at common instants: forces, and how orientations bent, smoothed alike.

The joint of two segments, at :math:`r` in the sensor's frame, accelerates by

.. math:: a = R f + g + \ddot R\, r

as either segment's IMU tells it. Both parts are taken as means over a triangle two intervals T
wide around an instant: of R f that of the samples in it; of :math:`\ddot R` it is just
:math:`(R(t+T) - 2 R(t) + R(t-T)) / T^2`, so no rate is ever differentiated. The triangle passes
what is slower than 4 Hz: skin swings faster.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pose_core.kernels.compiling import compiled
from pose_core.kernels.imu import interpolate
from pose_core.kernels.rotations import matrix_of_quaternion
from pose_core.kernels.tracks import HISTORY_NS
from pose_core.streams.samples import FloatArray

INTERVAL_NS = 100_000_000  # T
LONGEST_GAP_NS = 60_000_000  # between samples, beyond which instants nearby say nothing
INSTANTS = 128  # that are kept of each IMU
LEAST_WEIGHT = 2.0  # [-] samples' weights under the triangle


class JointSeries(NamedTuple):
    """The recent past of n IMUs, in rings: instant k at k mod 128."""

    stamps_ns: NDArray[np.int64]  # (n,) of the newest sample; 0: none
    orientation: FloatArray  # (n, 4) of that sample
    instant: NDArray[np.int64]  # (n, 128) which instant stands there; −1: none
    force: FloatArray  # (n, 128, 3) [m/s²] sum in the IMU's world
    weight: FloatArray  # (n, 128) [-] of that sum
    R_world_sensor: FloatArray  # (n, 128, 3, 3); NaN: not known


def make_joint_series(count: int) -> JointSeries:
    """Of IMUs that have not spoken yet."""
    return JointSeries(
        stamps_ns=np.zeros(count, np.int64),
        orientation=np.zeros((count, 4)),
        instant=np.full((count, INSTANTS), -1, np.int64),
        force=np.zeros((count, INSTANTS, 3)),
        weight=np.zeros((count, INSTANTS)),
        R_world_sensor=np.full((count, INSTANTS, 3, 3), np.nan),
    )


@compiled
def take_forces(
    series: JointSeries,
    imu: NDArray[np.int64],
    stamps_ns: NDArray[np.int64],
    orientation: FloatArray,
    force: FloatArray,
) -> None:
    """Take samples in; those that go back are left out, far back all begins anew.

    Args:
        series: What is kept.
        imu: Whose samples, (m,); nobody's if negative.
        stamps_ns: Likewise, (m,) [ns].
        orientation: R_world_sensor as quaternions x, y, z, w, (m, 4).
        force: The specific force in the sensor's frame, (m, 3) [m/s²]; NaN: not known.
    """
    R = np.empty((3, 3))
    for row in range(len(imu)):
        i, stamp_ns = imu[row], stamps_ns[row]
        if i < 0:
            continue
        before_ns = series.stamps_ns[i]
        if stamp_ns <= before_ns:
            if before_ns - stamp_ns < HISTORY_NS:
                continue
            series.instant[i] = -1  # the clock was set back
            before_ns = 0
        k = stamp_ns // INTERVAL_NS
        x, y, z = force[row, 0], force[row, 1], force[row, 2]
        if stamp_ns - before_ns > LONGEST_GAP_NS or np.isnan(x + y + z):
            spoil(series, i, before_ns // INTERVAL_NS, k + 1)
        else:
            at, after = k % INSTANTS, (k + 1) % INSTANTS
            if series.instant[i, after] != k + 1:
                empty(series, i, k)
                empty(series, i, k + 1)
            matrix_of_quaternion(orientation[row], R)
            share = (stamp_ns - k * INTERVAL_NS) / INTERVAL_NS
            series.weight[i, at] += 1.0 - share
            series.weight[i, after] += share
            for m in range(3):
                felt = R[m, 0] * x + R[m, 1] * y + R[m, 2] * z
                series.force[i, at, m] += (1.0 - share) * felt
                series.force[i, after, m] += share * felt
            if before_ns < k * INTERVAL_NS:
                part = (k * INTERVAL_NS - before_ns) / (stamp_ns - before_ns)
                q = series.orientation[i]
                interpolate(q, orientation[row], part, series.R_world_sensor[i, at])
        series.stamps_ns[i] = stamp_ns
        for m in range(4):
            series.orientation[i, m] = orientation[row, m]


@compiled
def empty(series: JointSeries, i: int, k: int) -> None:
    """Make room for instant k, unless it has been made."""
    at = k % INSTANTS
    if series.instant[i, at] != k:
        series.instant[i, at] = k
        series.force[i, at] = 0.0
        series.weight[i, at] = 0.0
        series.R_world_sensor[i, at] = np.nan


@compiled
def spoil(series: JointSeries, i: int, first: int, last: int) -> None:
    """These instants say nothing: samples are missing around them."""
    for k in range(max(first, last - INSTANTS + 1), last + 1):
        empty(series, i, k)
        series.weight[i, k % INSTANTS] = np.nan


@compiled
def tell_accelerations(series: JointSeries, i: int, first: int, out: FloatArray) -> None:
    """What one IMU tells of the accelerations of points of its segment.

    Args:
        series: What is kept.
        i: Which IMU.
        first: The first of m instants.
        out: Filled, (m, 3, 4): column 0 the sensor's specific force [m/s²], the others R̈ [1/s²], by
            which a point's place in the sensor's frame is to be multiplied; in the IMU's world. NaN
            where an instant is not known.
    """
    per_s2 = (1e9 / INTERVAL_NS) ** 2
    for m in range(len(out)):
        k = first + m
        at = k % INSTANTS
        before, after = (k - 1) % INSTANTS, (k + 1) % INSTANTS
        instant = series.instant[i]
        if instant[before] != k - 1 or instant[at] != k or instant[after] != k + 1:
            out[m] = np.nan
            continue
        if not series.weight[i, at] > LEAST_WEIGHT:
            out[m] = np.nan
            continue
        R = series.R_world_sensor[i]
        for row in range(3):
            out[m, row, 0] = series.force[i, at, row] / series.weight[i, at]
            for col in range(3):
                bent = R[before, row, col] - 2.0 * R[at, row, col] + R[after, row, col]
                out[m, row, 1 + col] = per_s2 * bent
