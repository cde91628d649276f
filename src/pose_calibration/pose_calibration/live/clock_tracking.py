"""Tracking of the sources' clocks after the calibration: drift, and steps when a clock is set.

Every ten seconds the offsets are measured in the last twenty seconds, near their last values, and
a line is fitted to the measurements. If no offset is found there, the whole range is searched.
If an offset far from the line is found twice, the clock has been set: older measurements are
dropped.
"""

from collections import deque

import numpy as np

from pose_calibration.clocks.clock_drift import Measured, clock_from
from pose_calibration.clocks.clock_offset import FINE_REACH_S, find_shift, measure_window
from pose_calibration.clocks.joint_delays import LAG_SPREAD_S
from pose_calibration.clocks.motion_track import Track, track_of
from pose_calibration.inertial.imu_clock import TRACKER_DELAY_S, is_clocks, measure_imu_window
from pose_calibration.inertial.imu_motion import (
    TRACKER_LAG_STDDEV_S,
    ImuMemory,
    View,
    measure_imu_delay,
)
from pose_core.api import IMUS, Clock, Clocks, Extrinsics, SkeletonSample, on_reference_clock
from pose_core.stamps import NS_PER_S

EVERY_NS = 10 * NS_PER_S
WINDOW_NS = 20 * NS_PER_S
MOST_MEASURED = 120  # [-] twenty minutes
STALE_NS = 300 * NS_PER_S  # [ns] after which a clock from a file is not used
STRAYS = 2  # [-] successive outliers from which on a step is assumed


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
        self._measured: dict[str, deque[Measured]] = {}
        self._strays: dict[str, int] = {}
        self._begin_ns: int | None = None
        self._due_ns = 0

    def add(self, sample: SkeletonSample, imus: ImuMemory) -> Clocks | None:
        """Add a sample, stamped by its own clock; returns the clocks after each measurement."""
        if sample.sensor not in self._samples:
            return None
        recent = self._samples[sample.sensor]
        if recent and sample.stamp_ns <= recent[-1].stamp_ns:
            if recent[-1].stamp_ns - sample.stamp_ns < NS_PER_S:
                return None
            self._begin_anew()
        recent.append(sample)
        while sample.stamp_ns - recent[0].stamp_ns > WINDOW_NS:
            recent.popleft()
        if sample.sensor != self._extrinsics.reference:
            return None
        if self._begin_ns is None:
            self._begin_ns, self._due_ns = sample.stamp_ns, sample.stamp_ns + EVERY_NS
            self._remember_known(sample.stamp_ns)
        if sample.stamp_ns < self._due_ns:
            return None
        self._due_ns = sample.stamp_ns + EVERY_NS
        self._measure_all(self._begin_ns, imus)
        return self.clocks

    def _begin_anew(self) -> None:
        """Drop all samples after a clock was set back, or a recording restarted."""
        for recent in self._samples.values():
            recent.clear()
        self._measured.clear()
        self._begin_ns = None

    def _remember_known(self, now_ns: int) -> None:
        """Use the calibration's result as the first measurement."""
        for source, clock in self.clocks.items():
            if abs(clock.at_ns - now_ns) < STALE_NS and clock.stddev_s > 0.0:
                known = Measured(
                    at_s=(clock.at_ns - now_ns) / NS_PER_S,
                    offset_s=clock.offset_ns / NS_PER_S,
                    noise_s=0.5 * clock.stddev_s,
                    stddev_s=clock.stddev_s,
                )
                self._measured[source] = deque([known], maxlen=MOST_MEASURED)

    def _measure_all(self, begin_ns: int, imus: ImuMemory) -> None:
        tracks = {name: track_of(list(ones), begin_ns) for name, ones in self._samples.items()}
        reference = tracks[self._extrinsics.reference]
        for name, track in tracks.items():
            if name == self._extrinsics.reference:
                continue
            one = self._measure(name, reference, track)
            if one is not None:
                measured = self._note(name, one)
                self.clocks[name] = clock_from(measured, begin_ns, LAG_SPREAD_S)
        if imus.segments:
            self._measure_imus(begin_ns, imus)

    def _known_s(self, name: str) -> float:
        """Offset [s] by which a source's clock is ahead now; 0 if unknown."""
        clock = self.clocks.get(name)
        if clock is None:
            measured = self._measured.get(name)
            return measured[-1].offset_s if measured else 0.0
        return clock.ahead_ns(self._due_ns - EVERY_NS) / NS_PER_S

    def _measure(self, name: str, a: Track, b: Track) -> Measured | None:
        if min(len(a.stamps), len(b.stamps)) < 2:
            return None
        known_s = self._known_s(name)
        one = measure_window(a, b, known_s)
        if one is not None:
            self._strays[name] = 0
            return one
        elsewhere = find_shift(a, b, self._max_offset_s)
        if elsewhere is None or abs(elsewhere - known_s) < FINE_REACH_S:
            return None
        self._strays[name] = self._strays.get(name, 0) + 1
        if self._strays[name] < STRAYS:
            return None
        self._measured.pop(name, None)
        return measure_window(a, b, elsewhere)

    def _measure_imus(self, begin_ns: int, imus: ImuMemory) -> None:
        views = [
            View(
                track_of([on_reference_clock(s, self.clocks) for s in ones], begin_ns),
                self._extrinsics.T_map_sensor(name)[2, :3],
            )
            for name, ones in self._samples.items()
            if len(ones) > 1
        ]
        verticals = imus.verticals(begin_ns)
        views = [view for view in views if len(view.track.stamps) > 1]
        if not views:
            return
        delay_s = self._known_s(IMUS) - TRACKER_DELAY_S
        one = measure_imu_window(views, verticals, delay_s)
        if one is None:
            far = measure_imu_delay(views, verticals, self._max_offset_s + TRACKER_DELAY_S)
            self._strays[IMUS] = self._strays.get(IMUS, 0) + int(np.isfinite(far.stddev_s))
            if self._strays[IMUS] < STRAYS or not np.isfinite(far.stddev_s):
                return
            self._measured.pop(IMUS, None)
            one = measure_imu_window(views, verticals, far.estimate_s)
            if one is None:
                return
        self._strays[IMUS] = 0
        clock = clock_from(self._note(IMUS, one), begin_ns, TRACKER_LAG_STDDEV_S)
        if is_clocks(clock.offset_ns / NS_PER_S):
            self.clocks[IMUS] = clock
        else:
            self.clocks.pop(IMUS, None)

    def _note(self, name: str, one: Measured) -> list[Measured]:
        measured = self._measured.setdefault(name, deque(maxlen=MOST_MEASURED))
        measured.append(one)
        return list(measured)
