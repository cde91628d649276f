"""Tracking of the sources' clocks after the calibration: drift, and steps when a clock is set.

A camera's clock that nobody knows, as where only the cameras' poses are given, is searched in the
whole range every two seconds until an offset is found. From then on, every ten seconds the offsets
are measured in the last twenty seconds, near their last values, and a line is fitted to the
measurements. If no offset is found there, the whole range is searched. If an offset far from the
line is found twice, the clock has been set: older measurements are dropped. Clocks of single IMUs
are compared with the others' once a window.
"""

from collections import deque
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from pose_calibration.clocks.clock_drift import MeasuredOffset, clock_from
from pose_calibration.clocks.clock_offset import (
    FINE_REACH_S,
    estimate_clock_offset,
    find_shift,
    measure_window,
)
from pose_calibration.clocks.joint_delays import LAG_SPREAD_S
from pose_calibration.clocks.motion_track import Track, track_of
from pose_calibration.inertial.imu_clock import (
    NEAR_S,
    TRACKER_DELAY_S,
    as_worn,
    clearly_apart,
    imus_ahead,
    is_clocks,
    measure_imu_window,
    views_on_reference_clock,
)
from pose_calibration.inertial.imu_memory import ImuMemory
from pose_calibration.inertial.imu_motion import (
    TRACKER_LAG_STDDEV_S,
    exchanged_sides,
    measure_imu_delay,
)
from pose_core.api import IMUS, ONE_IMU, Clock, Clocks, Extrinsics, SkeletonSample
from pose_core.stamps import JUMP_BACK_NS, NS_PER_S

EVERY_NS = 10 * NS_PER_S
SEARCH_EVERY_NS = 2 * NS_PER_S  # [ns] while no offset is known
WINDOW_NS = 20 * NS_PER_S
MAX_MEASURED = 120  # [-] twenty minutes
STALE_NS = 300 * NS_PER_S  # [ns] after which a clock from a file is not used
OUTLIERS_OF_STEP = 2  # [-] in succession, from which on a step is assumed


class ClockTracker:
    """Tracks the offset and drift of all sources' clocks.

    Args:
        extrinsics: Poses of the sensors, and the initial clocks.
        max_offset_s: Largest offset [s] of the search.
    """

    def __init__(self, extrinsics: Extrinsics, max_offset_s: float) -> None:
        self.clocks: dict[str, Clock] = dict(extrinsics.clocks)
        self._extrinsics = extrinsics
        self._max_offset_s = max_offset_s
        self._samples: dict[str, deque[SkeletonSample]] = {s: deque() for s in extrinsics.sensors}
        self._offsets: dict[str, deque[MeasuredOffset]] = {}
        self._outliers: dict[str, int] = {}
        self._begin_ns: int | None = None
        self._due_ns = 0
        self._search_due_ns = 0
        self._single_due_ns = 0

    def add(self, sample: SkeletonSample, imus: ImuMemory) -> Clocks | None:
        """Add a sample, stamped by its own clock; returns the clocks after each measurement."""
        if sample.sensor not in self._samples:
            return None
        recent = self._samples[sample.sensor]
        if recent and sample.stamp_ns <= recent[-1].stamp_ns:
            if recent[-1].stamp_ns - sample.stamp_ns < JUMP_BACK_NS:
                return None
            for each in self._samples.values():  # a clock was set back, or a recording restarted
                each.clear()
            self._offsets.clear()
            self._begin_ns, self._single_due_ns = None, 0
        recent.append(sample)
        while sample.stamp_ns - recent[0].stamp_ns > WINDOW_NS:
            recent.popleft()
        if sample.sensor != self._extrinsics.reference:
            return None
        if self._begin_ns is None:
            self._begin_ns, self._due_ns = sample.stamp_ns, sample.stamp_ns + EVERY_NS
            self._search_due_ns = sample.stamp_ns + SEARCH_EVERY_NS
            self._remember_known(sample.stamp_ns)
        if sample.stamp_ns < self._due_ns:
            is_due = sample.stamp_ns >= self._search_due_ns
            return self.clocks if is_due and self._search(sample.stamp_ns) else None
        self._due_ns = sample.stamp_ns + EVERY_NS
        self._measure_all(self._begin_ns, imus)
        return self.clocks

    def _remember_known(self, now_ns: int) -> None:
        """Use the calibration's result as the first measurement."""
        for source, clock in self.clocks.items():
            if abs(clock.at_ns - now_ns) < STALE_NS and clock.stddev_s > 0.0:
                known = MeasuredOffset(
                    at_s=(clock.at_ns - now_ns) / NS_PER_S,
                    offset_s=clock.offset_ns / NS_PER_S,
                    noise_s=0.5 * clock.stddev_s,
                    stddev_s=clock.stddev_s,
                )
                self._offsets[source] = deque([known], maxlen=MAX_MEASURED)

    def _search(self, now_ns: int) -> bool:
        """Search the clocks of cameras that are unknown; whether one is clearly off was found."""
        self._search_due_ns = now_ns + SEARCH_EVERY_NS
        reference, found = self._samples[self._extrinsics.reference], False
        for name, samples in self._samples.items():
            if name == self._extrinsics.reference or name in self.clocks:
                continue
            offset = estimate_clock_offset(reference, samples, self._max_offset_s)
            if offset.clock is not None and abs(offset.estimate_s) >= FINE_REACH_S:
                self.clocks[name], found = offset.clock, True
        return found

    def _measure_all(self, begin_ns: int, imus: ImuMemory) -> None:
        tracks = {name: track_of(ones, begin_ns) for name, ones in self._samples.items()}
        reference = tracks.pop(self._extrinsics.reference)
        for name, track in tracks.items():
            if min(len(reference.stamps), len(track.stamps)) < 2:
                continue
            near = partial(measure_window, reference, track)
            offset = self._measure(name, near, partial(self._shift_elsewhere, reference, track))
            if offset is not None:
                self.clocks[name] = self._clock(name, offset, begin_ns, LAG_SPREAD_S)
        if imus.segments:
            self._measure_imus(begin_ns, imus)

    def _shift_elsewhere(self, reference: Track, track: Track, known_s: float) -> float | None:
        """The shift [s] found in the whole range; None if it is the known one, or there is none."""
        shift_s = find_shift(reference, track, self._max_offset_s)
        is_other = shift_s is not None and abs(shift_s - known_s) >= FINE_REACH_S
        return shift_s if is_other else None

    def _known_s(self, name: str) -> float:
        """Offset [s] by which a source's clock is ahead now; 0 if unknown."""
        clock = self.clocks.get(name)
        if clock is None:
            offsets = self._offsets.get(name)
            return offsets[-1].offset_s if offsets else 0.0
        return clock.ahead_ns(self._due_ns - EVERY_NS) / NS_PER_S

    def _measure(
        self,
        name: str,
        near: Callable[[float], MeasuredOffset | None],
        far: Callable[[float], float | None],
    ) -> MeasuredOffset | None:
        """Measure a source's offset near the known one, or elsewhere once its clock was set.

        Args:
            name: The source.
            near: Measures an offset near a given one [s].
            far: Searches the whole range for an offset [s] other than the given one.
        """
        known_s = self._known_s(name)
        offset = near(known_s)
        if offset is None:
            elsewhere_s = far(known_s)
            if elsewhere_s is None:
                return None
            self._outliers[name] = self._outliers.get(name, 0) + 1
            if self._outliers[name] < OUTLIERS_OF_STEP:
                return None
            self._offsets.pop(name, None)
            offset = near(elsewhere_s)
        if offset is not None:
            self._outliers[name] = 0
        return offset

    def _measure_imus(self, begin_ns: int, imus: ImuMemory) -> None:
        """Measure the IMUs' common clock, and once a window those of single IMUs against it."""
        views = views_on_reference_clock(self._extrinsics, self.clocks, self._samples, begin_ns)
        if not any(len(track.stamps) > 1 for track in views.tracks):
            return
        verticals, reach_s = imus.verticals(begin_ns), self._max_offset_s + TRACKER_DELAY_S
        exchanged = exchanged_sides(views, verticals, reach_s)
        verticals = as_worn(verticals, exchanged)

        def far(_known_s: float) -> float | None:
            delay = measure_imu_delay(views, verticals, reach_s)
            return delay.estimate_s + TRACKER_DELAY_S if np.isfinite(delay.stddev_s) else None

        offset = self._measure(IMUS, partial(measure_imu_window, views, verticals), far)
        if offset is None:
            return
        clock = self._clock(IMUS, offset, begin_ns, TRACKER_LAG_STDDEV_S)
        if is_clocks(clock.offset_ns / NS_PER_S, offset.stddev_s, self.clocks):
            self.clocks[IMUS] = clock
        else:
            self.clocks.pop(IMUS, None)
        if self._due_ns < self._single_due_ns:
            return
        self._single_due_ns = self._due_ns + WINDOW_NS
        ahead = imus_ahead(views, verticals, offset.offset_s - TRACKER_DELAY_S)
        apart = clearly_apart(ahead, as_worn(imus.leads_s, exchanged))
        for segment, one in ahead.items():
            source = ONE_IMU + exchanged.get(segment, segment)
            if self._is_own_clock(source, one.estimate_s, is_apart=segment in apart):
                stddev_s = one.stddev_s
                own = replace(offset, offset_s=one.estimate_s, noise_s=stddev_s, stddev_s=stddev_s)
                self.clocks[source] = self._clock(source, own, begin_ns, TRACKER_LAG_STDDEV_S)

    def _is_own_clock(self, source: str, ahead_s: float, *, is_apart: bool) -> bool:
        """Whether a single IMU has a clock of its own, as before or as measured twice.

        Args:
            source: The IMU.
            ahead_s: By how much its clock is ahead of the common one [s].
            is_apart: Whether it is clearly off.
        """
        nearest_s = min(NEAR_S, abs(ahead_s))  # nearer to the known one than to zero
        if source in self.clocks and abs(ahead_s - self._known_s(source)) < nearest_s:
            return True
        self.clocks.pop(source, None)
        self._offsets.pop(source, None)
        self._outliers[source] = self._outliers.get(source, 0) + 1 if is_apart else 0
        return self._outliers[source] >= OUTLIERS_OF_STEP

    def _clock(
        self, name: str, offset: MeasuredOffset, begin_ns: int, systematic_s: float
    ) -> Clock:
        offsets = self._offsets.setdefault(name, deque(maxlen=MAX_MEASURED))
        offsets.append(offset)
        return clock_from(list(offsets), begin_ns, systematic_s)
