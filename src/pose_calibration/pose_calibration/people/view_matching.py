"""Matching of persons between two sensors with unknown extrinsics.

Each pair of a person in one view and a person in the other is a hypothesis: if they are the same
person, the rigid transform that fits their joints best is the sensors' transform. Different people
move differently, so a wrong pair has a bad fit; if both stand still, the transform of a wrong pair
does not fit the other persons. The hypothesis that agrees with most joints of all persons is used.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pose_calibration.clocks.motion_track import Track, track_of
from pose_calibration.geometry.rigid_transform import (
    CalibrationError,
    estimate_rigid_transform_robustly,
)
from pose_core.api import Clock, Clocks, FloatArray, PeopleTracker, SkeletonSample, transformed
from pose_core.finite_numbers import are_known
from pose_core.joints import JOINTS

SHIFTS_S = (0.0, -0.2, 0.2, -0.4, 0.4)  # [s] tried offsets between the sensors' clocks
INSTANTS = 150  # [-] evaluated of a pair's common time
MIN_COMMON = 40  # [-] required of them with both persons
SAME_M = 0.3  # [m] largest median distance of one person's joints in both views
MIN_DURATION_S = 1.0  # [s] shortest presence of a person
BEST = 12  # [-] hypotheses that are evaluated on all persons
STILL_FACTOR = 0.1  # [m] travel added to every person's, so that those at rest count a little

Views = Mapping[int, Sequence[SkeletonSample]]
"""One sensor's samples by person, as numbered in that sensor's own view."""


@dataclass(frozen=True, kw_only=True)
class Hypothesis:
    """Transform between two sensors if two views are of the same person."""

    T_target_source: FloatArray  # (4, 4)
    shift_s: float  # [s] by which the source's stamps are later
    median: float  # [m] distance of the joints
    explained: float = 0.0  # [-] agreeing joints over all persons' instants, weighted by travel


def views_of_sensor(frames: Sequence[Sequence[SkeletonSample]]) -> dict[int, list[SkeletonSample]]:
    """Persons in one sensor's frames; those present for a short time are left out."""
    by_person: dict[int, list[SkeletonSample]] = {}
    if frames:
        tracker = PeopleTracker({frames[0][0].sensor: np.eye(4)})
        for frame in frames:
            for number, sample in tracker.add(frame):
                by_person.setdefault(number, []).append(sample)
    return {
        number: samples
        for number, samples in by_person.items()
        if samples[-1].stamp_ns - samples[0].stamp_ns > MIN_DURATION_S * 1e9
    }


def match_views(target: Views, source: Views) -> Hypothesis | None:
    """Estimate the transform between two sensors from all persons; None if no pair agrees.

    Args:
        target: The first sensor's samples by person, stamps ascending.
        source: The second sensor's samples.
    """
    if not target or not source:
        return None
    begin_ns = min(samples[0].stamp_ns for samples in (*target.values(), *source.values()))
    targets = [track_of(samples, begin_ns) for samples in target.values()]
    sources = [track_of(samples, begin_ns) for samples in source.values()]
    found = [
        hypothesis
        for a in targets
        for b in sources
        if (hypothesis := _hypothesis(a, b)) is not None and hypothesis.median < SAME_M
    ]
    best = sorted(found, key=lambda each: each.median)[:BEST]
    judged = [replace(each, explained=_explained(each, targets, sources)) for each in best]
    return max(judged, key=lambda each: each.explained, default=None)


def rough_places(
    views: Mapping[str, Views], reference: str
) -> tuple[dict[str, FloatArray], Clocks]:
    """Approximate poses of the sensors in the reference's frame, (4, 4), and their clocks.

    Sensors are linked one after the other to the one with the best hypothesis; those without a
    hypothesis are left out.
    """
    placed: dict[str, FloatArray] = {reference: np.eye(4)}
    shifts_s = {reference: 0.0}
    known: dict[tuple[str, str], Hypothesis | None] = {}
    while True:
        for a in placed:
            for b in views:
                if b not in placed and (a, b) not in known:
                    known[a, b] = match_views(views[a], views[b])
        links = [
            (link.explained, a, b, link)
            for (a, b), link in known.items()
            if link is not None and a in placed and b not in placed
        ]
        if not links:
            break
        _, a, b, link = max(links, key=lambda each: each[0])
        placed[b] = placed[a] @ link.T_target_source
        shifts_s[b] = shifts_s[a] + link.shift_s
    clocks = {name: Clock(offset_ns=round(shift * 1e9)) for name, shift in shifts_s.items()}
    return placed, {name: clock for name, clock in clocks.items() if clock.offset_ns}


def _hypothesis(a: Track, b: Track) -> Hypothesis | None:
    """The transform and shift under which two views agree best."""
    best: Hypothesis | None = None
    if min(len(a.stamps), len(b.stamps)) < MIN_COMMON:
        return None
    for shift_s in SHIFTS_S:
        instants = _common_instants(a, b, shift_s)
        at_target, at_source = a.at(instants), b.at(instants + shift_s)
        known = are_known(at_target + at_source)
        if known.any(axis=1).sum() < MIN_COMMON:
            continue
        try:
            fit = estimate_rigid_transform_robustly(at_source[known], at_target[known])
        except CalibrationError:
            continue
        if best is None or fit.median < best.median:
            T, median = fit.T_target_source, fit.median
            best = Hypothesis(T_target_source=T, shift_s=shift_s, median=median)
    return best


def _common_instants(a: Track, b: Track, shift_s: float) -> FloatArray:
    first = max(a.stamps[0], b.stamps[0] - shift_s)
    last = min(a.stamps[-1], b.stamps[-1] - shift_s)
    inside = a.stamps[(a.stamps >= first) & (a.stamps <= last)]
    return inside[:: max(1, len(inside) // INSTANTS)]


def _explained(hypothesis: Hypothesis, targets: Sequence[Track], sources: Sequence[Track]) -> float:
    """Number of agreeing joints over the instants of all persons, weighted by their travel."""
    total = 0.0
    for a in targets:
        scores = []
        for b in sources:
            instants = _common_instants(a, b, hypothesis.shift_s)
            if len(instants) < MIN_COMMON:
                continue
            at_target = a.at(instants)
            moved = transformed(hypothesis.T_target_source, b.at(instants + hypothesis.shift_s))
            distance = np.linalg.norm(at_target - moved, axis=2)
            agrees = np.maximum(1.0 - distance / SAME_M, 0.0)
            seconds = float(instants[-1] - instants[0]) / len(instants)
            scores.append(float(np.nansum(agrees)) / len(JOINTS) * seconds * _travel(at_target))
        total += max(scores, default=0.0)
    return total


def _travel(positions: FloatArray) -> float:
    """Spatial spread of a person's joints over time [m]: a person at rest determines little."""
    known = positions[are_known(positions)]
    return STILL_FACTOR + float(np.sqrt(np.var(known, axis=0).sum())) if len(known) else 0.0
