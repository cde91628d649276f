"""Recent samples of all IMUs, and interpolation of their orientations."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from pose_core.arrays import FloatArray, rows_of
from pose_core.imu.imu_rows import ImuRows
from pose_core.kernels.compiling import type_specialised
from pose_core.kernels.imu_rings import MAX_GAP_NS, ImuRings, ImuStates, append_samples, read_states
from pose_core.stamps import NS_PER_S
from pose_core.streams.samples import ImuBlock

ALIVE_NS = 200_000_000  # [ns] an IMU whose last sample is older is silent
MAX_PERIOD_NS = 1.05 * MAX_GAP_NS  # of an IMU that is used, with what a period jitters
PERIODS = 10  # whose median is an IMU's period
MIN_PERIODS = 3  # before it is known


@dataclass(frozen=True, kw_only=True, eq=False)
class ImuMeasurements:
    """Measurements of several IMUs at one instant, interpolated, one for each row."""

    segments: tuple[str, ...]
    R_world_sensor: FloatArray  # (n, 3, 3)
    angular_velocity: FloatArray  # (n, 3) [rad/s] in the sensors' frames
    stddev: FloatArray  # (n, 3) [rad] about the axes of their reference frames
    age_s: FloatArray  # (n,) [s] for which each is extrapolated by the gyroscope
    slips: Mapping[str, int] = field(default_factory=dict)  # so far, of those that have slipped
    heading_walks: Mapping[str, float] = field(default_factory=dict)
    """Walks of headings [rad/√s] that are larger than in an undisturbed field."""
    replaced_rates: frozenset[str] = frozenset()  # whose rates are the orientation's change

    def __len__(self) -> int:
        return len(self.segments)


class ImuHistory:
    """Stores the last samples of every IMU, in the order of their stamps.

    Between two samples the state is interpolated; after the last one, the gyroscope is integrated.
    """

    def __init__(self) -> None:
        self._rows = ImuRows(ImuRings())
        self.segments = self._rows.segments
        self._append_samples = type_specialised(append_samples)
        self._read = type_specialised(read_states)
        self.gaps_ns: dict[str, int] = {}
        """Gaps of the last block that are too long to interpolate [ns]."""
        self.slow: dict[str, float] = {}
        """Rates [Hz] of IMUs that send too seldom to be interpolated: they have no measurements."""
        self._order = np.zeros(0, np.int64)  # of the rings, by their segments' names
        self._ordered: tuple[str, ...] = ()

    def add(self, block: ImuBlock) -> int:
        """Store samples; return how many were rejected because their IMU has newer ones."""
        imus = self._rows.of(block)
        if len(self._ordered) < len(self.segments):
            self._order, self._ordered = np.argsort(self.segments), tuple(sorted(self.segments))
        gap_ns = np.zeros(len(self.segments), np.int64)
        rejected = self._append_samples(
            self._rows.memory,
            imus,
            block.stamps_ns,
            block.orientation,
            block.orientation_stddev,
            block.angular_velocity,
            gap_ns,
        )
        self.gaps_ns = self._rows.named(np.where(gap_ns > MAX_GAP_NS, gap_ns, 0))
        if self.gaps_ns or self.slow:
            self.slow = self._slow_rates()
        return rejected

    def _slow_rates(self) -> dict[str, float]:
        rings, rates = self._rows.memory, np.zeros(len(self.segments))
        size = rings.stamps_ns.shape[1]
        for imu in range(len(rates)):
            periods = min(int(rings.filled[imu]) - 1, PERIODS)
            last = (rings.newest[imu] - np.arange(periods + 1)) % size
            if periods >= MIN_PERIODS:
                period_ns = float(np.median(-np.diff(rings.stamps_ns[imu, last])))
                rates[imu] = NS_PER_S / period_ns if period_ns > MAX_PERIOD_NS else 0.0
        return self._rows.named(rates)

    def newest_ns(self, segment: str) -> int:
        """Stamp of the last sample of an IMU [ns]."""
        return int(self._last_ns()[self.segments.index(segment)])

    def silent(self, stamp_ns: int) -> tuple[str, ...]:
        """The IMUs, sorted, whose last sample is too long before an instant."""
        silent = self._rows.named(stamp_ns - self._last_ns() > ALIVE_NS)
        return tuple(sorted(name for name in silent if name not in self.slow))

    def _last_ns(self) -> NDArray[np.int64]:
        """Stamp of each IMU's last sample [ns], (imus,)."""
        rings = self._rows.memory
        return rings.stamps_ns[np.arange(len(self.segments)), rings.newest]

    def at(self, stamp_ns: int) -> ImuMeasurements:
        """Measurements of all IMUs at an instant; without slow ones, and those silent around it.

        Sorted by segment, so that the order of arrival does not change even the rounding.
        """
        count = len(self.segments)
        states = ImuStates(
            R_world_sensor=np.empty((count, 3, 3)),
            rate=np.empty((count, 3)),
            stddev=np.empty((count, 3)),
            known=np.empty(count, np.bool_),
            age_s=np.empty(count),
        )
        known_count = self._read(self._rows.memory, self._order, stamp_ns, states)
        measurements = ImuMeasurements(
            segments=self._ordered,
            R_world_sensor=states.R_world_sensor,
            angular_velocity=states.rate,
            stddev=states.stddev,
            age_s=states.age_s,
        )
        if known_count == count and not self.slow:
            return measurements
        is_slow = np.array([name in self.slow for name in self._ordered])
        known = np.flatnonzero(states.known & ~is_slow)
        segments = tuple(self._ordered[row] for row in known.tolist())
        return replace(rows_of(measurements, known), segments=segments)


NO_MEASUREMENTS = ImuMeasurements(
    segments=(),
    R_world_sensor=np.zeros((0, 3, 3)),
    angular_velocity=np.zeros((0, 3)),
    stddev=np.zeros((0, 3)),
    age_s=np.zeros(0),
)
"""States of no IMUs."""
