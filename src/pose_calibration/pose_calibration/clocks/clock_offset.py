r"""The offset between two sensors' clocks, from motion that both measured.

First the shift :math:`\tau` of one sensor's stamps that minimises the difference between the
high-passed motions in the two views, :math:`\min_\tau \overline{| a(s) - R\,b(s + \tau) |^2}`, for
all shifts at once by the Fourier transform; then each joint's own delay (:mod:`joint_delays`).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pose_calibration.clocks.clock_drift import MeasuredOffset, clock_from, measure_outwards
from pose_calibration.clocks.joint_delays import LAG_SPREAD_S, UNKNOWN_DELAY, Delay, estimate_delay
from pose_calibration.clocks.motion_track import (
    APART_S,
    GRID_RATE,
    SEARCHED_S,
    Track,
    track_of,
    without_slow,
)
from pose_calibration.geometry.rigid_transform import (
    CalibrationError,
    RobustFit,
    estimate_rigid_transform_robustly,
)
from pose_core.api import Clock, FloatArray, SkeletonSample, transformed
from pose_core.finite_numbers import are_known
from pose_core.stamps import NS_PER_S

FIT_STEP_S = 0.3  # [s] between the shifts under which the relative rotation is estimated
COARSE_SLOW_S = 3.0  # [s] slower differences are filtered out
MIN_WHOLE = 0.8  # [-] share of that time in which a joint must be known
MIN_OVERLAP_S = 2.0  # [s] of a joint in both views, under every shift
AMBIGUOUS = 1.1  # [-] of the least difference: another shift within this factor makes it ambiguous
BEYOND_S = 0.1  # [s] searched beyond the largest offset: a minimum there is rejected
TOLERANCE_S = 0.02  # [s] by which an offset may exceed the largest one: its uncertainty
MIN_FRAMES = 30  # [-] of each sensor
REFINEMENTS = 2  # [-] of the offset by the joints' delays
FINE_REACH_S = 0.08  # [s] about the best shift
OBSERVABLE_STDDEV_S = 0.017  # [s] half a frame: less certain offsets are not used
WINDOW_S = 20.0  # [s] in which a delay is measured, to find the drift
MAX_WINDOWS = 40  # [-]


@dataclass(frozen=True, kw_only=True)
class ClockOffset:
    """Offset by which one sensor's clock is ahead of the reference's."""

    estimate_s: float  # [s]
    stddev_s: float  # [s] infinite if the motion does not determine it
    clock: Clock | None = None  # with its drift; None if the motion does not determine it

    @property
    def observable(self) -> bool:
        """Whether the motion determines the offset."""
        return self.stddev_s <= OBSERVABLE_STDDEV_S


UNKNOWN_OFFSET = ClockOffset(estimate_s=0.0, stddev_s=np.inf)


def estimate_clock_offsets(
    by_sensor: Mapping[str, Sequence[SkeletonSample]], sensors: Sequence[str], max_offset_s: float
) -> tuple[dict[str, ClockOffset], dict[str, Clock]]:
    """The offset of each sensor's clock but the first one's, and the clocks that are determined.

    Args:
        by_sensor: One person's samples by sensor, stamps ascending.
        sensors: The sensors' names, the reference first.
        max_offset_s: Largest offset [s] of the search.
    """
    reference, *others = (by_sensor.get(name, ()) for name in sensors)
    found = [estimate_clock_offset(reference, other, max_offset_s) for other in others]
    offsets = dict(zip(sensors[1:], found, strict=True))
    return offsets, {n: one.clock for n, one in offsets.items() if one.clock is not None}


def estimate_clock_offset(
    reference: Sequence[SkeletonSample], other: Sequence[SkeletonSample], max_offset_s: float = 0.5
) -> ClockOffset:
    """Estimate the offset and drift of another sensor's clock relative to the reference's.

    Args:
        reference: One person's samples, stamps ascending.
        other: The same person's from the other sensor, stamps ascending.
        max_offset_s: Largest offset [s] of the search.

    Returns:
        The offset; its standard deviation is infinite if the person moved too little or was
        tracked too briefly, or if the motion is so periodic that several shifts agree equally well.
    """
    if min(len(reference), len(other)) < MIN_FRAMES:
        return UNKNOWN_OFFSET
    begin_ns = reference[0].stamp_ns
    a, b = track_of(reference, begin_ns), track_of(other, begin_ns)
    if min(len(a.stamps), len(b.stamps)) < MIN_FRAMES:
        return UNKNOWN_OFFSET
    begin_s = _liveliest(a)
    searched = a.between(begin_s, begin_s + SEARCHED_S)
    coarse = find_shift(searched, b, max_offset_s)
    if coarse is None:
        return UNKNOWN_OFFSET
    offset, delay = coarse, UNKNOWN_DELAY
    for _ in range(REFINEMENTS):
        delay = measure_delay(searched, b, offset)
        offset += delay.estimate_s
    if abs(offset - coarse) > FINE_REACH_S or abs(offset) > max_offset_s + TOLERANCE_S:
        return UNKNOWN_OFFSET
    found = ClockOffset(estimate_s=offset, stddev_s=delay.stddev_s)
    if not found.observable:
        return found
    measured = _over_time(a, b, offset, begin_s)
    clock = Clock(offset_ns=round(offset * NS_PER_S), stddev_s=delay.stddev_s)
    if measured:
        clock = clock_from(measured, begin_ns, LAG_SPREAD_S)
    return replace(found, clock=clock)


def measure_delay(a: Track, b: Track, offset: float) -> Delay:
    """The other's remaining delay after an offset [s] has been subtracted."""
    moved, known, fit = _fit_shifted(a, b, offset)
    if fit is None:
        return UNKNOWN_DELAY
    positions = a.values.copy()
    outlier = known.copy()
    outlier[known] = fit.weights == 0.0
    positions[outlier] = np.nan
    return estimate_delay(a.stamps, positions, transformed(fit.T_target_source, moved))


def _fit_shifted(
    a: Track, b: Track, shift: float
) -> tuple[FloatArray, NDArray[np.bool_], RobustFit | None]:
    """The other's joints at the reference's stamps plus a shift [s], (n, 15, 3), in its own frame.

    Returns:
        Those joints, the mask (n, 15) of those known in both views, and their fit to the
        reference's view; None if they do not determine it.
    """
    moved = b.at(a.stamps + shift)
    known = are_known(a.values + moved)
    try:
        return moved, known, estimate_rigid_transform_robustly(moved[known], a.values[known])
    except CalibrationError:
        return moved, known, None


def find_shift(a: Track, b: Track, max_offset_s: float) -> float | None:
    """The shift [s] of the other's stamps under which the motions agree best; None without one.

    Args:
        a: The reference's view, at most a minute.
        b: The other sensor's view.
        max_offset_s: Largest shift of the search [s].
    """
    turned = _turned_alike(a, b, max_offset_s)
    if turned is None:
        return None
    reach = round((max_offset_s + BEYOND_S) * GRID_RATE)
    grid = np.arange(a.stamps[0], a.stamps[-1], 1.0 / GRID_RATE)
    if len(grid) <= 2 * reach:
        return None
    difference = _mean_squares(a.at(grid), turned.at(grid), reach)
    shifts = np.arange(-reach, reach + 1) / GRID_RATE
    if not np.isfinite(difference).any():
        return None
    best = int(np.nanargmin(difference))
    apart = np.abs(shifts - shifts[best]) > APART_S
    elsewhere = np.nanmin(np.where(apart, difference, np.inf))
    at_edge = abs(shifts[best]) > max_offset_s + 0.5 * BEYOND_S
    if at_edge or elsewhere < AMBIGUOUS * difference[best]:
        return None
    return float(shifts[best])


def _turned_alike(a: Track, b: Track, max_offset_s: float) -> Track | None:
    """The other's view transformed to the reference's frame, fitted under the shifts tried."""
    fits = []
    steps = int(max_offset_s / FIT_STEP_S)
    for shift in FIT_STEP_S * np.arange(-steps, steps + 1):
        _, _, fit = _fit_shifted(a, b, shift)
        if fit is not None:
            fits.append((fit.median, fit.T_target_source))
    if not fits:
        return None
    _, T = min(fits, key=lambda each: each[0])
    return Track(b.stamps, transformed(T, b.values))


def _mean_squares(a: FloatArray, b: FloatArray, reach: int) -> FloatArray:
    """Mean squared difference [m²] of high-passed motion under shifts of -reach to reach samples.

    Unknown samples are masked (Padfield, 2012, IEEE TIP 21(5), for images).

    Args:
        a: Joints on a grid, (n, 15, 3) [m], NaN where unknown.
        b: The same of the other view.
        reach: Largest shift [samples].
    """
    # Imported here: scipy takes half a second to load, not at a node's start.
    from scipy import fft
    from scipy.ndimage import uniform_filter1d

    width = round(COARSE_SLOW_S * GRID_RATE)
    quick, known = [], []
    for positions in (a, b):
        is_known = are_known(positions)
        filled = np.where(is_known[..., None], positions, 0.0)
        # Moving means over incomplete windows are not comparable between the views.
        is_whole = uniform_filter1d(is_known.astype(float), width, axis=0, mode="constant")
        quick.append(without_slow(filled, is_known, width).reshape(len(positions), -1))
        is_known &= is_whole > MIN_WHOLE
        quick[-1][~np.repeat(is_known, 3, axis=1)] = 0.0
        known.append(np.repeat(is_known, 3, axis=1).astype(float))

    def correlation(one: FloatArray, other: FloatArray) -> FloatArray:
        size = fft.next_fast_len(len(one) + reach + 1)
        product = np.conj(fft.rfft(one, size, axis=0)) * fft.rfft(other, size, axis=0)
        summed = fft.irfft(product.sum(axis=1), size)
        return np.asarray(np.concatenate([summed[-reach:], summed[: reach + 1]]))

    count = correlation(known[0], known[1])
    squares = correlation(quick[0] ** 2, known[1]) + correlation(known[0], quick[1] ** 2)
    squares -= 2.0 * correlation(quick[0], quick[1])
    enough = count > 3.0 * MIN_OVERLAP_S * GRID_RATE
    return np.where(enough, squares / np.maximum(count, 1.0), np.nan)


def _liveliest(track: Track) -> float:
    """Start [s] of the window of :data:`SEARCHED_S` with the most motion."""
    begin, end = float(track.stamps[0]), float(track.stamps[-1])
    if end - begin <= SEARCHED_S:
        return begin
    ways = np.nan_to_num(np.abs(np.diff(track.values, axis=0))).sum(axis=(1, 2))
    travelled = np.concatenate([[0.0], np.cumsum(ways)])
    starts = np.arange(begin, end - SEARCHED_S, 0.5 * SEARCHED_S)
    first, last = (np.interp(starts + d, track.stamps, travelled) for d in (0.0, SEARCHED_S))
    return float(starts[int(np.argmax(last - first))])


def _over_time(a: Track, b: Track, offset: float, begin_s: float) -> list[MeasuredOffset]:
    """Delays in windows over the whole recording, from the known offset outwards."""
    first, last = float(a.stamps[0]), float(a.stamps[-1])
    count = int(np.clip((last - first) // WINDOW_S, 1, MAX_WINDOWS))
    every = (last - first) / count
    width = every if count < MAX_WINDOWS else WINDOW_S
    starts = first + every * np.arange(count)
    return measure_outwards(
        starts,
        begin_s,
        offset,
        lambda start, near: measure_window(a.between(start, start + width), b, near),
    )


def measure_window(a: Track, b: Track, offset: float) -> MeasuredOffset | None:
    """The offset in one window, near a known one [s]; None if the motion is too small."""
    if len(a.stamps) < MIN_FRAMES:
        return None
    delay = measure_delay(a, b, offset)
    if not delay.stddev_s <= OBSERVABLE_STDDEV_S or abs(delay.estimate_s) > FINE_REACH_S:
        return None
    return MeasuredOffset(
        at_s=float(a.stamps.mean()) + offset,
        offset_s=offset + delay.estimate_s,
        noise_s=delay.noise_s,
        stddev_s=delay.stddev_s,
    )
