"""Calibration results from body-worn IMUs: the offset of their clock, and the vertical.

A tracker's delay and a clock offset cannot be separated. An offset within the range of trackers'
delays is left to the fusion, which estimates each tracker's delay from IMUs. A larger offset is
attributed to the IMUs' clock, with a typical delay of the trackers. A single IMU that is clearly
apart from most others has a clock of its own.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from pose_calibration.clocks.clock_drift import MeasuredOffset, clock_from, measure_outwards
from pose_calibration.clocks.joint_delays import Delay
from pose_calibration.clocks.motion_track import SEARCHED_S, Track, track_of
from pose_calibration.floor.gravity import Gravity
from pose_calibration.inertial.imu_gravity import gravity_from_imus, searched_gravity
from pose_calibration.inertial.imu_memory import ImuMemory
from pose_calibration.inertial.imu_motion import (
    MIN_LIMBS,
    TRACKER_LAG_STDDEV_S,
    Views,
    exchanged_sides,
    measure_each_delay,
    measure_imu_delay,
)
from pose_calibration.inertial.vertical_search import search_vertical
from pose_core.api import (
    IMUS,
    ONE_IMU,
    Clock,
    Clocks,
    Extrinsics,
    SkeletonSample,
    on_reference_clock,
    reference_delay_s,
)
from pose_core.filter.tracker_errors import MAX_DELAY_S, MIN_DELAY_S
from pose_core.stamps import NS_PER_S

TRACKER_DELAY_S = 0.04  # [s] typical delay of trackers' joints behind their stamps
WINDOW_S = 30.0  # [s] in which a delay is measured, to find the drift
MAX_WINDOWS = 20  # [-]
NEAR_S = 0.1  # [s] about a known offset
LIMBS_LAG_STDDEV_S = 0.02  # [s] of a tracker's lag between limbs
SAME_LEAD_S = 0.06  # [s] within which the arrival of an IMU's samples agrees with its motion
EARLY_DEVIATIONS = 2.0  # [-] of the measured delay, by which a tracker may seem early
MAX_EARLY_S = 0.06  # [s] of these
CLEARLY = 4.0  # [-] standard deviations from most other IMUs, if its samples arrive accordingly
VERY_CLEARLY = 6.0  # [-] if they do not; sound IMUs are apart by up to 4.7

T = TypeVar("T")


@dataclass(frozen=True, kw_only=True)
class ImuFindings:
    """Estimates from body-worn IMUs."""

    offset_s: float  # [s] by which their clock is ahead
    offset_stddev_s: float  # [s] infinite if the motion does not determine it
    clocks: Clocks  # all IMUs' unless the offset may be a tracker's delay, and single ones'
    gravity: Gravity | None  # None if the upright body is as certain


def is_clocks(offset_s: float, stddev_s: float, clocks: Clocks) -> bool:
    """Whether an offset of the IMUs' clock [s] is outside the range of trackers' delays.

    Trackers that seem early by no more than the measurement's error are in time. The reference's
    is late by what the other cameras' ``clocks`` tell.
    """
    earliest_s = MIN_DELAY_S + reference_delay_s(clocks)
    earliest_s -= min(EARLY_DEVIATIONS * stddev_s, MAX_EARLY_S)
    return not earliest_s <= TRACKER_DELAY_S - offset_s <= MAX_DELAY_S


def imu_findings(
    extrinsics: Extrinsics,
    skeletons: Mapping[str, Sequence[SkeletonSample]],
    memory: ImuMemory,
    max_offset_s: float,
) -> ImuFindings:
    """Compare the IMUs with the cameras' skeletons.

    Args:
        extrinsics: Poses and clocks of the sensors.
        skeletons: One person's samples by sensor, stamps ascending and uncorrected.
        memory: The IMUs' orientations.
        max_offset_s: Largest offset [s] of the search.
    """
    begin_ns = min(ones[0].stamp_ns for ones in skeletons.values() if ones)
    views = views_on_reference_clock(extrinsics, extrinsics.clocks, skeletons, begin_ns)
    verticals = memory.verticals(begin_ns)
    floor, reach_s = extrinsics.floor, max_offset_s + TRACKER_DELAY_S
    begin_s, up = _middle(views), None
    searched = views.between(begin_s, begin_s + SEARCHED_S)
    if floor is not None and floor.up_stddev:
        up = search_vertical(searched, verticals, reach_s)
    if up is not None:
        views, searched = replace(views, up=up), replace(searched, up=up)
    exchanged = exchanged_sides(searched, verticals, reach_s)
    verticals = as_worn(verticals, exchanged)
    delay = measure_imu_delay(searched, verticals, reach_s)
    offset_s = delay.estimate_s + TRACKER_DELAY_S
    if not np.isfinite(delay.stddev_s) or abs(offset_s) > max_offset_s:
        return ImuFindings(offset_s=0.0, offset_stddev_s=np.inf, clocks={}, gravity=None)
    leads_s = as_worn(memory.leads_s, exchanged)
    apart = clearly_apart(imus_ahead(searched, verticals, delay.estimate_s), leads_s)
    if apart:  # they have spoilt the common offset
        verticals = in_time(verticals, apart)
        again = measure_imu_delay(searched, verticals, NEAR_S, delay.estimate_s)
        delay = again if np.isfinite(again.stddev_s) else delay
        offset_s = delay.estimate_s + TRACKER_DELAY_S
    clocks = {
        ONE_IMU + exchanged.get(segment, segment): Clock(
            offset_ns=round(own.estimate_s * NS_PER_S), at_ns=begin_ns, stddev_s=own.stddev_s
        )
        for segment, own in apart.items()
    }
    if is_clocks(offset_s, delay.stddev_s, extrinsics.clocks):
        measured = _over_time(views, verticals, delay.estimate_s)
        if measured:
            clocks[IMUS] = clock_from(measured, begin_ns, TRACKER_LAG_STDDEV_S)
    gravity = None
    if floor is not None and up is not None:
        gravity = searched_gravity(searched, verticals, delay.estimate_s, floor.source)
    elif floor is not None and floor.up_stddev:
        gravity = gravity_from_imus(
            searched, verticals, delay.estimate_s, floor.up_stddev, floor.source
        )
    return ImuFindings(
        offset_s=offset_s, offset_stddev_s=delay.stddev_s, clocks=clocks, gravity=gravity
    )


def as_worn(by_segment: Mapping[str, T], exchanged: Mapping[str, str]) -> dict[str, T]:
    """What belongs to IMUs, by the segments on which they are worn; ``exchanged`` are others'."""
    return {exchanged.get(name, name): each for name, each in by_segment.items()}


def imus_ahead(views: Views, verticals: Mapping[str, Track], delay_s: float) -> dict[str, Delay]:
    """By how much each IMU is ahead of their median [s], by segment, as far as motion tells.

    Trackers are late by a different time for each limb: that is part of the standard deviations.

    Args:
        views: Joints measured by each camera.
        verticals: The vertical in each IMU, by segment.
        delay_s: The IMUs' common delay behind the views [s].
    """
    each = measure_each_delay(views, verticals, delay_s)
    if len(each) < MIN_LIMBS:
        return {}
    common_s = float(np.median([one.estimate_s for one in each.values()]))
    return {
        segment: Delay(
            estimate_s=one.estimate_s - common_s,
            stddev_s=float(np.hypot(one.stddev_s, LIMBS_LAG_STDDEV_S)),
        )
        for segment, one in each.items()
    }


def clearly_apart(ahead: Mapping[str, Delay], leads_s: Mapping[str, float]) -> dict[str, Delay]:
    """The IMUs whose clocks are clearly ahead of the others' or behind them.

    None if they are not a minority: then it is unknown which clocks are right.

    Args:
        ahead: By how much each is ahead by its motion, by segment.
        leads_s: By how much each is ahead of the samples that arrive with its own [s], by segment.
            Samples that are late, and stamped when they arrive, are ahead by their motion alone.
            None are behind alone: they would arrive before they are taken.
    """
    apart = {}
    for segment, own in ahead.items():
        unconfirmed_s = own.estimate_s - leads_s.get(segment, own.estimate_s)
        least = CLEARLY if abs(unconfirmed_s) < SAME_LEAD_S else VERY_CLEARLY
        if abs(own.estimate_s) > least * own.stddev_s and unconfirmed_s > -SAME_LEAD_S:
            apart[segment] = own
    return apart if 2 * len(apart) < len(ahead) else {}


def in_time(verticals: Mapping[str, Track], apart: Mapping[str, Delay]) -> dict[str, Track]:
    """The verticals with the stamps of single IMUs corrected by how much these are ahead."""
    late = {
        segment: Track(verticals[segment].stamps - one.estimate_s, verticals[segment].values)
        for segment, one in apart.items()
    }
    return {**verticals, **late}


def measure_imu_window(
    views: Views, verticals: Mapping[str, Track], offset_s: float
) -> MeasuredOffset | None:
    """The IMUs' offset in one window, near a known one [s]; None if the motion is too small."""
    delay_s = offset_s - TRACKER_DELAY_S
    delay = measure_imu_delay(views, verticals, NEAR_S, delay_s)
    if not np.isfinite(delay.stddev_s):
        return None
    at_s = float(np.mean([track.stamps.mean() for track in views.tracks if len(track.stamps)]))
    return MeasuredOffset(
        at_s=at_s + delay_s,
        offset_s=delay.estimate_s + TRACKER_DELAY_S,
        noise_s=delay.noise_s,
        stddev_s=delay.stddev_s,
    )


def views_on_reference_clock(
    extrinsics: Extrinsics,
    clocks: Clocks,
    skeletons: Mapping[str, Sequence[SkeletonSample]],
    begin_ns: int,
) -> Views:
    """Views of all sensors, their stamps corrected by these clocks."""
    tracks = []
    for name, ones in skeletons.items():
        track = track_of([on_reference_clock(one, clocks) for one in ones], begin_ns)
        R_reference_sensor = extrinsics.T_reference_sensor[name][:3, :3]
        tracks.append(Track(track.stamps, track.values @ R_reference_sensor.T))
    return Views(tracks, extrinsics.T_map_reference[2, :3])


def _over_time(
    views: Views, verticals: Mapping[str, Track], delay_s: float
) -> list[MeasuredOffset]:
    first, last = views.span_s
    every = max(WINDOW_S, (last - first) / MAX_WINDOWS)
    count = max(1, round((last - first) / every))
    starts = first + (last - first) / count * np.arange(count)

    def measure(start: float, near: float) -> MeasuredOffset | None:
        window = views.between(start, start + max(WINDOW_S, (last - first) / count))
        return measure_imu_window(window, verticals, near)

    return measure_outwards(starts, _middle(views) - every, delay_s + TRACKER_DELAY_S, measure)


def _middle(views: Views) -> float:
    """Start [s] of the middle minute of the views."""
    first, last = views.span_s
    return max(first, 0.5 * (first + last - SEARCHED_S))
