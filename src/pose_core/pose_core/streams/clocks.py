r"""Offsets of the sources' clocks to the reference sensor's, and correction of stamps.

With :math:`s` a source's stamp, the instant on the reference's clock is

.. math:: t = s - o - d\,(s - s_0)

where :math:`o` is the offset of the source's clock at its stamp :math:`s_0` (positive if ahead),
and
:math:`d` its drift. A source is a Kinect, by its name, or all IMUs together, because one bridge
usually stamps all of them. The clock of a single IMU that something else stamps is relative to
theirs.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pose_core.stamps import NS_PER_S
from pose_core.streams.samples import ImuBlock, SkeletonSample
from pose_core.streams.series import SkeletonSeries

IMUS = "imus"
"""Name of the source that consists of all IMUs."""
ONE_IMU = f"{IMUS}/"
"""Begin of the name of a single IMU's clock, before its segment."""
REACH_NS = 1800 * NS_PER_S  # [ns] from its measurement for which a drift is applied
USUAL_DELAY_S = 0.1  # [s] of trackers, at most
CLOCKS_APART_S = 0.3  # [s] by which clocks of two computers differ at most


@dataclass(frozen=True, kw_only=True)
class Clock:
    """Offset and drift of a source's clock; positive if it is ahead of the reference's."""

    offset_ns: int = 0  # at ``at_ns``
    drift: float = 0.0  # [-] seconds gained a second
    at_ns: int = 0  # [ns] a stamp of the source's own
    stddev_s: float = 0.0  # [s] of the offset; 0 if it is not known
    drift_stddev: float = 0.0  # [-] the same of the drift

    def ahead_ns(self, stamp_ns: int) -> int:
        """Offset of the clock at one of the source's stamps [ns]."""
        since_ns = min(max(stamp_ns - self.at_ns, -REACH_NS), REACH_NS)
        return self.offset_ns + round(self.drift * since_ns)

    def to_reference(self, stamp_ns: int) -> int:
        """The instant on the reference's clock [ns]."""
        return stamp_ns - self.ahead_ns(stamp_ns)


Clocks = Mapping[str, Clock]
"""Clocks by source; one that is missing agrees with the reference's."""


def is_imus(source: str) -> bool:
    """Whether a source is the IMUs, or a single one."""
    return source == IMUS or source.startswith(ONE_IMU)


def earlier_than_reference_s(clocks: Clocks) -> float:
    """How much earlier [s] than the reference the earliest other camera seems; 0 if none does."""
    offsets_ns = [clock.offset_ns for source, clock in clocks.items() if not is_imus(source)]
    return max(0.0, -min(offsets_ns, default=0) / NS_PER_S)


def reference_delay_s(clocks: Clocks) -> float:
    """How late the reference's tracker probably is [s], by the offsets of the other cameras.

    An offset found from motion is the difference of the trackers' delays, or of the clocks, and a
    tracker is late, never early. So where a camera seems to be behind by little, the reference is
    late. Prior: as often one clock, and delays evenly between 0 and :data:`USUAL_DELAY_S`, as
    clocks that differ evenly by up to :data:`CLOCKS_APART_S`. The result is the mean under it.
    """
    earlier_s = earlier_than_reference_s(clocks)
    # The difference of two even delays has a triangular density.
    by_delays = max(0.0, 1.0 - earlier_s / USUAL_DELAY_S) / USUAL_DELAY_S
    by_clocks = 0.5 / CLOCKS_APART_S
    return earlier_s * by_delays / (by_delays + by_clocks)


def reference_stamp_ns(sample: SkeletonSample, clocks: Clocks) -> int:
    """A sample's stamp on the reference's clock [ns]."""
    clock = clocks.get(sample.sensor)
    return sample.stamp_ns if clock is None else clock.to_reference(sample.stamp_ns)


def on_reference_clock(sample: SkeletonSample, clocks: Clocks, delay_ns: int = 0) -> SkeletonSample:
    """A sample with its stamp converted to the reference's clock, less a delay [ns]."""
    stamp_ns = reference_stamp_ns(sample, clocks) - delay_ns
    return sample if stamp_ns == sample.stamp_ns else replace(sample, stamp_ns=stamp_ns)


def block_on_reference_clock(block: ImuBlock, clocks: Clocks) -> ImuBlock:
    """IMU samples with their stamps converted to the reference's clock."""
    stamps_ns, clock = block.stamps_ns, clocks.get(IMUS)
    if clock is not None:
        stamps_ns = _stamps_on_reference_clock(stamps_ns, clock)
    for source, own in clocks.items():
        segment = source.removeprefix(ONE_IMU)
        if segment != source and segment in block.segments:
            is_own = block.imu == block.segments.index(segment)
            stamps_ns = np.where(is_own, _stamps_on_reference_clock(stamps_ns, own), stamps_ns)
    return block if stamps_ns is block.stamps_ns else replace(block, stamps_ns=stamps_ns)


def series_on_reference_clock(series: SkeletonSeries, clock: Clock | None) -> SkeletonSeries:
    """A source's joints over time with their stamps converted to the reference's clock."""
    if clock is None:
        return series
    return replace(series, stamps_ns=_stamps_on_reference_clock(series.stamps_ns, clock))


def _stamps_on_reference_clock(stamps_ns: NDArray[np.int64], clock: Clock) -> NDArray[np.int64]:
    since_ns = np.clip(stamps_ns - clock.at_ns, -REACH_NS, REACH_NS)
    ahead_ns = clock.offset_ns + np.rint(clock.drift * since_ns).astype(np.int64)
    return np.asarray(stamps_ns - ahead_ns)


def moved_most_ns(before: Clocks, after: Clocks, stamp_ns: int) -> int:
    """Largest change of any source's stamps [ns] near a stamp if other clocks are used."""
    none = Clock()
    moved_ns = (
        abs(after.get(name, none).ahead_ns(stamp_ns) - before.get(name, none).ahead_ns(stamp_ns))
        for name in {*before, *after}
    )
    return max(moved_ns, default=0)
