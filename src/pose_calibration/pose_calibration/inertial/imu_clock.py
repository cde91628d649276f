"""What body-worn IMUs add to a calibration: their clock, and the vertical.

A tracker is late; how late cannot be told from how a clock is set. So what a tracker's delay can
explain is left to the fusion, which finds each tracker's delay where there are IMUs. Only beyond
that is the IMUs' clock taken to be set otherwise, and the trackers to be late as most are.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pose_calibration.clocks.clock_drift import Measured, clock_from
from pose_calibration.clocks.motion_track import Track, track_of
from pose_calibration.floor.gravity import Gravity
from pose_calibration.inertial.imu_gravity import gravity_from_imus
from pose_calibration.inertial.imu_motion import (
    TRACKER_LAG_STDDEV_S,
    ImuMemory,
    ImuVertical,
    View,
    measure_imu_delay,
)
from pose_core.api import Clock, Extrinsics, SkeletonSample, on_reference_clock

TRACKER_DELAY_S = 0.04  # [s] of trackers' joints behind their stamps, where a clock is off, too
TRACKER_DELAYS_S = (-0.02, 0.15)  # [s] that the fusion finds (pose_core.filter.adaptation)
SEARCHED_S = 60.0  # [s] of a longer recording: drifting clocks blur the rest
WINDOW_S = 30.0  # [s] in which a delay is measured, for the drift
MOST_WINDOWS = 20  # [-]
NEAR_S = 0.1  # [s] about a known offset


@dataclass(frozen=True, kw_only=True)
class ImuFindings:
    """Estimates from body-worn IMUs."""

    offset_s: float  # [s] by which their clock is ahead
    offset_stddev_s: float  # [s] infinite where nothing was to be seen
    clock: Clock | None  # None where a tracker's delay explains the offset
    gravity: Gravity | None  # None where an upright body is as certain


def is_clocks(offset_s: float) -> bool:
    """Whether an offset of the IMUs' clock [s] is more than a tracker's delay explains."""
    shortest, longest = TRACKER_DELAYS_S
    return not shortest <= TRACKER_DELAY_S - offset_s <= longest


def imu_findings(
    extrinsics: Extrinsics,
    skeletons: Mapping[str, Sequence[SkeletonSample]],
    memory: ImuMemory,
    max_offset_s: float,
) -> ImuFindings:
    """Compare the IMUs with what the cameras see.

    Args:
        extrinsics: Where the sensors stand, with their clocks.
        skeletons: One person's samples by sensor, stamps ascending and as they came.
        memory: The IMUs' orientations.
        max_offset_s: Largest offset [s] to look for.
    """
    begin_ns = min(ones[0].stamp_ns for ones in skeletons.values() if ones)
    views = _views(extrinsics, skeletons, begin_ns)
    verticals = memory.verticals(begin_ns)
    searched = _cut(views, _middle(views), SEARCHED_S)
    delay = measure_imu_delay(searched, verticals, max_offset_s + TRACKER_DELAY_S)
    offset_s = delay.estimate_s + TRACKER_DELAY_S
    if not np.isfinite(delay.stddev_s) or abs(offset_s) > max_offset_s:
        return ImuFindings(offset_s=0.0, offset_stddev_s=np.inf, clock=None, gravity=None)
    clock = None
    if is_clocks(offset_s):
        measured = _over_time(views, verticals, delay.estimate_s)
        clock = clock_from(measured, begin_ns, TRACKER_LAG_STDDEV_S) if measured else None
    known = extrinsics.floor.up_stddev if extrinsics.floor is not None else 0.0
    turns = [extrinsics.T_reference_sensor[name][:3, :3] for name in skeletons]
    gravity = (
        gravity_from_imus(searched, turns, verticals, delay.estimate_s, known) if known else None
    )
    return ImuFindings(
        offset_s=offset_s, offset_stddev_s=delay.stddev_s, clock=clock, gravity=gravity
    )


def measure_imu_window(
    views: Sequence[View], verticals: Mapping[str, ImuVertical], delay_s: float
) -> Measured | None:
    """The IMUs' offset in one stretch, near a known delay [s]; None if nothing moves enough."""
    delay = measure_imu_delay(views, verticals, NEAR_S, delay_s)
    if not np.isfinite(delay.stddev_s):
        return None
    at_s = float(np.mean([view.track.stamps.mean() for view in views if len(view.track.stamps)]))
    return Measured(
        at_s=at_s + delay_s,
        offset_s=delay.estimate_s + TRACKER_DELAY_S,
        noise_s=delay.noise_s,
        stddev_s=delay.stddev_s,
    )


def _views(
    extrinsics: Extrinsics, skeletons: Mapping[str, Sequence[SkeletonSample]], begin_ns: int
) -> list[View]:
    """What each sensor sees, on the reference's clock."""
    return [
        View(
            track_of([on_reference_clock(one, extrinsics.clocks) for one in ones], begin_ns),
            extrinsics.T_map_sensor(name)[2, :3],
        )
        for name, ones in skeletons.items()
    ]


def _over_time(
    views: list[View], verticals: Mapping[str, ImuVertical], delay_s: float
) -> list[Measured]:
    first = min(float(view.track.stamps[0]) for view in views if len(view.track.stamps))
    last = max(float(view.track.stamps[-1]) for view in views if len(view.track.stamps))
    every = max(WINDOW_S, (last - first) / MOST_WINDOWS)
    count = max(1, round((last - first) / every))
    starts = first + (last - first) / count * np.arange(count)
    middle = _middle(views)
    measured = []
    for direction in (starts[starts >= middle - every], starts[starts < middle - every][::-1]):
        known = delay_s
        for start in direction:
            one = measure_imu_window(_cut(views, start, max(WINDOW_S, every)), verticals, known)
            if one is not None:
                measured.append(one)
                known = one.offset_s - TRACKER_DELAY_S
    return sorted(measured, key=lambda one: one.at_s)


def _middle(views: Sequence[View]) -> float:
    """Where the middle minute of what was seen begins [s]."""
    first = min(float(view.track.stamps[0]) for view in views if len(view.track.stamps))
    last = max(float(view.track.stamps[-1]) for view in views if len(view.track.stamps))
    return max(first, 0.5 * (first + last - SEARCHED_S))


def _cut(views: Sequence[View], begin_s: float, duration_s: float) -> list[View]:
    def part(track: Track) -> Track:
        return track.between(begin_s, begin_s + duration_s)

    return [View(part(view.track), view.up) for view in views]
