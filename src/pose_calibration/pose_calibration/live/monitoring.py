"""Monitoring after the calibration: drift of the clocks, and sensors that are moved."""

from dataclasses import replace

from pose_calibration.inertial.imu_motion import ImuMemory
from pose_calibration.live.clock_tracking import ClockTracker
from pose_calibration.live.watchdog import Watchdog
from pose_core.api import (
    Clocks,
    Extrinsics,
    SkeletonSample,
    TimeAligner,
    moved_most_ns,
    on_reference_clock,
)

CHANGED_NS = 500_000  # [ns] change from which on a clock is published again


class Monitoring:
    """Tracks the sources' clocks and compares the views, from one calibration to the next.

    Args:
        extrinsics: The calibration to monitor.
        aligner: Aligns the samples, which are corrected by the clocks tracked.
        max_offset_s: Largest offset [s] of the search for clocks.
    """

    def __init__(self, extrinsics: Extrinsics, aligner: TimeAligner, max_offset_s: float) -> None:
        self.extrinsics = extrinsics  # with the latest clocks
        self._aligner = aligner
        self._clock_tracker = ClockTracker(extrinsics, max_offset_s)
        self.watchdog = Watchdog(extrinsics)
        self._new_clocks: Clocks | None = None

    def take_clocks(self) -> Clocks | None:
        """The clocks, once after each change; None without a change."""
        clocks, self._new_clocks = self._new_clocks, None
        return clocks

    def add(self, sample: SkeletonSample, imus: ImuMemory) -> bool:
        """Add a sample, stamped by its own clock.

        Returns:
            Whether it shows that a sensor has been moved, which was not known before.
        """
        clocks, known = self._clock_tracker.add(sample, imus), self.extrinsics.clocks
        if clocks is not None and moved_most_ns(known, clocks, sample.stamp_ns) > CHANGED_NS:
            self._new_clocks = dict(clocks)
            self.extrinsics = replace(self.extrinsics, clocks=self._new_clocks)
        frames = self._aligner.add(on_reference_clock(sample, self.extrinsics.clocks))
        noticed = [self.watchdog.add(frame) for frame in frames]
        return any(moved is not None for moved in noticed)
