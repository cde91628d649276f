r"""Finds a sensor that was moved, during a recording or since its extrinsics were calibrated.

In windows of ten seconds, the small rigid motion :math:`(\omega, t)` is fitted that moves one
sensor's joints, placed by the extrinsics, onto the reference's:

.. math:: \min \sum_i \rho(\|p^b_i - p^a_i - \omega \times (p^a_i - c) - t\|)

It varies with the person's place and facing, since trackers err. A sensor was moved if its medians
before and after one instant differ by many standard deviations of this variation, and before the
recording if the median of all is large. Unlike the
watchdog of the live calibration, which has to notice a motion within seconds, the test uses
everything before and after.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from pose_core.api import (
    Extrinsics,
    FloatArray,
    SkeletonSample,
    TrackingState,
    longest_gap_s,
    series_from_samples,
    series_on_reference_clock,
    transformed,
)
from pose_core.finite_numbers import are_known, robust_stddev
from pose_core.stamps import NS_PER_S

WINDOW_S = 10.0
COMPARED_HZ = 14.0  # [Hz] of the instants at which views are compared
MIN_INSTANTS = 40  # [-] in a window
MIN_JOINTS = 4  # [-] at an instant
SAME_S = 2.0 * WINDOW_S  # [s] between steps of two views that are one motion, of the reference
MIN_WINDOWS = 3  # [-] before and after
HUBER_M = 0.04  # [m] residual from which on a joint has less weight
ITERATIONS = 5
DISPLACED = (np.radians(6.0), 0.07)  # [rad], [m] at the person; real ones differ by 3.4°, 4 cm
MIN_STDDEV = np.array([1e-3] * 3 + [2e-3] * 3)  # [rad], [m] of a window's correction
CERTAIN = 6.0  # [-] RMS of the six steps in standard deviations; at most 3.7 without a motion

BySensor: TypeAlias = Mapping[str, Sequence[SkeletonSample]]
"""One person's samples by sensor, stamps ascending."""


@dataclass(frozen=True, kw_only=True)
class MovedDuring:
    """A motion of a sensor during a recording."""

    sensors: tuple[str, ...]  # either of them, or the one that moved
    at_s: float  # [s] since the recording's first frame, to within a window
    angle: float  # [rad]
    distance: float  # [m] of the view at the person

    def __str__(self) -> str:
        """Message to the user."""
        who = " or ".join(f"'{name}'" for name in self.sensors)
        minutes, seconds = divmod(round(self.at_s), 60)
        return (
            f"{who} was moved at about {minutes}:{seconds:02d}, its view by "
            f"{np.degrees(self.angle):.1f}° and {100.0 * self.distance:.0f} cm: no extrinsics "
            "fit all of it; split the recording there"
        )


@dataclass(frozen=True, kw_only=True)
class Displaced:
    """A view that given extrinsics do not place where the reference's is."""

    sensor: str
    reference: str
    angle: float  # [rad]
    distance: float  # [m] at the person

    def __str__(self) -> str:
        """Message to the user."""
        return (
            f"'{self.sensor}': by these extrinsics its view is {np.degrees(self.angle):.1f}° and "
            f"{100.0 * self.distance:.0f} cm from that of '{self.reference}': one of them was "
            "moved since, or its tracker's distances are wrong; calibrate again"
        )


def find_moved(by_sensor: BySensor, extrinsics: Extrinsics) -> tuple[MovedDuring, ...]:
    """Sensors that were moved during a recording, by each sensor's view and the reference's.

    Args:
        by_sensor: Each sensor's samples.
        extrinsics: As estimated from all of them, with clocks.
    """
    return _moved(_views(by_sensor, extrinsics), extrinsics.reference)


def find_moved_or_displaced(
    by_sensor: BySensor, extrinsics: Extrinsics
) -> tuple[MovedDuring | Displaced, ...]:
    """:func:`find_moved`, or where it finds none the views that do not fit the reference's.

    Args:
        by_sensor: See :func:`find_moved`.
        extrinsics: As given, not estimated from these samples; with clocks.
    """
    views = _views(by_sensor, extrinsics)
    return _moved(views, extrinsics.reference) or _displaced(views, extrinsics.reference)


Views: TypeAlias = Mapping[str, tuple[FloatArray, FloatArray]]  # of each sensor but the reference


def _views(by_sensor: BySensor, extrinsics: Extrinsics) -> Views:
    """See :func:`_corrections`."""
    reference, *others = extrinsics.sensors
    first_ns, last_ns = (by_sensor[reference][at].stamp_ns for at in (0, -1))
    instants_ns = np.arange(first_ns, last_ns + 1, round(NS_PER_S / COMPARED_HZ))
    at_s = (instants_ns - instants_ns[0]) / NS_PER_S
    placed = _placed(by_sensor, reference, extrinsics, instants_ns)
    return {
        name: _corrections(at_s, placed, _placed(by_sensor, name, extrinsics, instants_ns))
        for name in others
    }


def _placed(
    by_sensor: BySensor, name: str, extrinsics: Extrinsics, instants_ns: NDArray[np.int64]
) -> FloatArray:
    """A sensor's tracked joints at instants of the reference, in its frame, (n, 15, 3) [m]."""
    series = series_from_samples(by_sensor[name])
    is_tracked = series.tracking_state == int(TrackingState.TRACKED)
    tracked = replace(series, positions=np.where(is_tracked[..., None], series.positions, np.nan))
    tracked = series_on_reference_clock(tracked, extrinsics.clocks.get(name))
    period_s = series.duration_s / max(len(series) - 1, 1)
    joints = tracked.at(instants_ns, longest_gap_s(period_s))
    return transformed(extrinsics.T_reference_sensor[name], joints)


def _moved(views: Views, reference: str) -> tuple[MovedDuring, ...]:
    """See :func:`find_moved`."""
    found = []
    for other, (starts_s, corrections) in views.items():
        for first, change in _steps(corrections):
            angle, distance = _sizes(change)
            at_s = float(starts_s[first])
            found.append(MovedDuring(sensors=(other,), at_s=at_s, angle=angle, distance=distance))
    motions: list[MovedDuring] = []
    for one in sorted(found, key=lambda one: one.at_s):
        moved = {each.sensors for each in found if abs(each.at_s - one.at_s) <= SAME_S}
        if len(moved) == len(views):  # of two views either may have moved
            sensors = (reference, *views) if len(views) == 1 else (reference,)
            last = motions[-1] if motions else None
            if last is not None and last.sensors == sensors and one.at_s - last.at_s <= SAME_S:
                continue
            one = replace(one, sensors=sensors)
        motions.append(one)
    return tuple(motions)


def _displaced(views: Views, reference: str) -> tuple[Displaced, ...]:
    """See :func:`find_moved_or_displaced`."""
    found = []
    for other, (_, corrections) in views.items():
        if len(corrections):
            angle, distance = _sizes(np.median(corrections, axis=0))
            if angle > DISPLACED[0] or distance > DISPLACED[1]:
                found.append(
                    Displaced(sensor=other, reference=reference, angle=angle, distance=distance)
                )
    return tuple(found)


def _sizes(correction: FloatArray) -> tuple[float, float]:
    """Angle [rad] and distance [m] of a correction, (6,)."""
    return float(np.linalg.norm(correction[:3])), float(np.linalg.norm(correction[3:]))


def _corrections(
    at_s: FloatArray, one: FloatArray, other: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Start of each window [s], (w,), and the correction of the second view in it, (w, 6).

    Args:
        at_s: Instants (n,) [s].
        one: The reference's joints, (n, 15, 3) [m] in its frame; NaN where unknown.
        other: The other's, placed by the extrinsics in the reference's frame.
    """
    is_known = are_known(one + other)
    is_known &= (is_known.sum(axis=1) >= MIN_JOINTS)[:, None]
    window = at_s // WINDOW_S
    starts, counts = np.unique(window[is_known.any(axis=1)], return_counts=True)
    kept = starts[counts >= MIN_INSTANTS]
    if not len(kept):
        return np.empty(0), np.empty((0, 6))
    is_known &= np.isin(window, kept)[:, None]
    centre = np.median(one[is_known], axis=0)
    joints = np.concatenate([one, other], axis=2)
    corrections = [
        _correction(joints[is_known & (window == each)[:, None]], centre) for each in kept
    ]
    return kept * WINDOW_S, np.array(corrections)


def _correction(joints: FloatArray, centre: FloatArray) -> FloatArray:
    """Rotation vector about the centre [rad] and translation [m], (6,), of joints (n, 6) [m]."""
    arm, difference = joints[:, :3] - centre, joints[:, 3:] - joints[:, :3]
    design = np.zeros((len(arm), 3, 6))
    design[:, :, :3] = np.cross(np.eye(3), arm[:, None, :]).transpose(0, 2, 1)  # e_k × arm
    design[:, :, 3:] = np.eye(3)
    weight = np.ones(len(arm))
    for _ in range(ITERATIONS):
        weighted = design * weight[:, None, None]
        normal = np.einsum("nij,nik->jk", weighted, design)
        solution = np.linalg.solve(normal, np.einsum("nij,ni->j", weighted, difference))
        residual = np.linalg.norm(difference - design @ solution, axis=1)
        weight = 1.0 / np.maximum(residual / HUBER_M, 1.0)
    return np.asarray(solution)


def _steps(corrections: FloatArray) -> list[tuple[int, FloatArray]]:
    """The first window after each clear step, and the step, (6,)."""
    found, begin = [], 0
    # Of a stair, the first split may lie between two steps: each is searched again between others.
    for end in [*_splits(corrections)[1:], len(corrections)]:
        step = _step(corrections[begin:end])
        if step is not None:
            begin += step[0]
            found.append((begin, step[1]))
    return found


def _splits(corrections: FloatArray) -> list[int]:
    """Windows at which the corrections are split, each time at the clearest step of a part."""
    found = _step(corrections)
    if found is None:
        return []
    split = found[0]
    after = (split + each for each in _splits(corrections[split:]))
    return [*_splits(corrections[:split]), split, *after]


def _step(corrections: FloatArray) -> tuple[int, FloatArray] | None:
    """The first window after the clearest step, and the step, (6,); None without a clear one."""
    count, best, found = len(corrections), CERTAIN, None
    for split in range(MIN_WINDOWS, count - MIN_WINDOWS + 1):
        before, after = corrections[:split], corrections[split:]
        middles = np.median(before, axis=0), np.median(after, axis=0)
        apart = np.vstack([before - middles[0], after - middles[1]])
        stddev = robust_stddev(apart) + MIN_STDDEV
        change = middles[1] - middles[0]
        of_change = stddev * np.sqrt(1.0 / split + 1.0 / (count - split))
        deviations = float(np.sqrt(np.mean((change / of_change) ** 2)))
        if deviations > best:
            best, found = deviations, (split, change)
    return found
