"""All IMUs of one body: recent samples, and states at an instant."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pose_core.counters import Counters
from pose_core.imu.angular_velocity_check import AngularVelocityCheck, RateFault
from pose_core.imu.burst_stamps import BurstStamps
from pose_core.imu.heading_walk import HeadingWalks
from pose_core.imu.imu_history import NO_MEASUREMENTS, ImuHistory, ImuMeasurements
from pose_core.imu.orientation_check import OrientationCheck
from pose_core.stamps import NS_PER_S
from pose_core.streams.samples import ImuBlock

MAX_NAMED = 3  # silences of one IMU
SILENCE_NS = 3 * NS_PER_S // 10  # [ns] a shorter gap between two samples is not named
ABSENCE_NS = NS_PER_S  # [ns] the same before its first sample and after its last one


class ImuSet:
    """The IMUs of one body, each with orientations in its own reference frame."""

    def __init__(self) -> None:
        self.history = ImuHistory()
        self._bursts = BurstStamps()
        self.rates = AngularVelocityCheck()
        self.orientations = OrientationCheck()
        self.walks = HeadingWalks()
        self._known_at: int | None = None  # [ns] the instant of ``_known``
        self._known = NO_MEASUREMENTS
        self._slips: Mapping[str, int] = {}
        self._first_ns: dict[str, int] = {}  # [ns] stamp of each IMU's first sample
        self._silences: dict[str, list[tuple[int, int]]] = {}  # [ns] begin and end of each
        self._replaced: frozenset[str] = frozenset()
        self.inverse: frozenset[str] = frozenset()
        """Segments whose IMU's orientations are the inverse, or in another order; not used."""
        self.z_down: frozenset[str] = frozenset()
        """Segments whose IMU's reference frame has a z axis that points down; it is turned over."""
        self._undecided: frozenset[str] = frozenset()  # may be the inverse; not used until known
        self.counters = Counters(
            "imu_gaps",
            "imu_readings_missing",
            "imu_samples_against_gyroscope",
            "imu_samples_inverse",
            "imu_samples_saturated",
            "imu_stamps_restored",
        )

    @property
    def segments(self) -> Sequence[str]:
        """Segments with samples of an IMU."""
        return list(self.history.segments)

    def has_samples(self, segment: str) -> bool:
        """Whether an IMU has sent usable samples."""
        return segment in self._first_ns

    @property
    def contradicted_rates(self) -> Mapping[str, str]:
        """What is wrong with angular velocities that are measured, if the orientation is not."""
        others = (RateFault.MISSING, RateFault.INVERSE)
        faults = self.rates.faults.items()
        return {name: str(fault) for name, fault in faults if fault not in others}

    def add(self, block: ImuBlock) -> int:
        """Store samples; return how many were rejected because their IMU has newer ones."""
        self._known_at = None
        arrived, block = block, self._bursts.restored(block)
        if block is not arrived:
            is_restored = block.stamps_ns != arrived.stamps_ns
            self.counters.add("imu_stamps_restored", int(is_restored.sum()))
        checked = self.orientations.checked(self.rates.checked(block))
        left_out = len(block) - len(checked)
        if left_out:
            counted = self.counters["imu_samples_saturated"]
            saturated = self.orientations.saturated_samples - counted
            self.counters.add("imu_samples_saturated", saturated)
            self.counters.add("imu_samples_against_gyroscope", left_out - saturated)
        self._slips, self._replaced = self.orientations.slips, self.rates.replaced
        self.inverse = self._undecided = frozenset()
        if self._replaced:
            self.inverse, self._undecided = self.rates.inverse, self.rates.undecided
        refused = self.inverse | self._undecided
        if refused:
            is_refused = np.array([name in refused for name in checked.segments])[checked.imu]
            self.counters.add("imu_samples_inverse", int(is_refused.sum()))
            checked = checked.rows(~is_refused)
        self.walks.add(checked, self._bursts.in_bursts)
        rejected = self.history.add(checked)
        self.counters.add("imu_gaps", len(self.history.gaps_ns))
        if len(self._first_ns) < len(self.history.segments):
            for imu in np.unique(checked.imu).tolist():
                first_ns = int(checked.stamps_ns[checked.imu == imu].min())
                self._first_ns.setdefault(checked.segments[imu], first_ns)
        for segment, gap_ns in self.history.gaps_ns.items():
            if gap_ns > SILENCE_NS:
                is_own = checked.imu == checked.segments.index(segment)
                silences = _silences(np.sort(checked.stamps_ns[is_own]), gap_ns)
                self._silences.setdefault(segment, []).extend(silences)
        return rejected

    def silence(self, segment: str, begin_ns: int, end_ns: int) -> str:
        """When an IMU had no usable samples for long; empty if it always had.

        Args:
            segment: The IMU's segment.
            begin_ns: An instant [ns], from which the text counts seconds.
            end_ns: A later instant [ns].
        """
        if segment not in self._first_ns:
            return ""
        first_ns, last_ns = self._first_ns[segment], self.history.newest_ns(segment)
        silences = list(self._silences.get(segment, ()))
        if first_ns - begin_ns > ABSENCE_NS:
            silences.insert(0, (begin_ns, first_ns))
        if end_ns - last_ns > ABSENCE_NS:
            silences.append((last_ns, end_ns))
        texts = [
            f"from {(start_ns - begin_ns) / NS_PER_S:.1f} "
            + (f"to {(stop_ns - begin_ns) / NS_PER_S:.1f} s" if stop_ns < end_ns else "s on")
            for start_ns, stop_ns in silences
        ]
        if len(texts) > MAX_NAMED:
            texts = [f"{len(texts)} times, the last {texts[-1]}"]
        return f"without usable samples {', '.join(texts)}" if texts else ""

    def silent(self, stamp_ns: int) -> tuple[str, ...]:
        """Segments whose IMU has sent nothing in the last 0.2 s before an instant."""
        silent = self.history.silent(stamp_ns)
        refused = self.inverse | self._undecided
        unused = {*self.orientations.excluded, *self.orientations.saturated, *refused}
        return tuple(segment for segment in silent if segment not in unused)

    def read(self, stamp_ns: int) -> ImuMeasurements:
        """The IMUs' measurements at an instant; those of the last instant are cached."""
        if not self.history.segments:
            return NO_MEASUREMENTS
        if self._known_at != stamp_ns:
            imus = self.history.at(stamp_ns)
            walks = self.walks.unsound
            if self._slips or self._replaced or walks:
                imus = replace(
                    imus, slips=self._slips, replaced_rates=self._replaced, heading_walks=walks
                )
            if self.z_down:
                is_down = np.array([name in self.z_down for name in imus.segments], np.bool_)
                upright = np.where(is_down, -1.0, 1.0)[:, None, None]
                rotations = imus.R_world_sensor.copy()
                rotations[:, 1:] *= upright
                imus = replace(imus, R_world_sensor=rotations)
            self._known, self._known_at = imus, stamp_ns
        missing = len(self.history.segments) - len(self._known)
        self.counters.add("imu_readings_missing", missing)
        return self._known


def _silences(stamps_ns: NDArray[np.int64], longest_ns: int) -> Iterator[tuple[int, int]]:
    """Begin and end [ns] of the silences of one IMU up to the end of a block.

    Args:
        stamps_ns: Its samples in the block, sorted [ns].
        longest_ns: The longest gap, of those before the first of them, too [ns].
    """
    gaps_ns = np.diff(stamps_ns)
    if longest_ns > gaps_ns.max(initial=0):
        yield int(stamps_ns[0]) - longest_ns, int(stamps_ns[0])
    for index in np.flatnonzero(gaps_ns > SILENCE_NS).tolist():
        yield int(stamps_ns[index]), int(stamps_ns[index + 1])
