r"""Time offset between cameras and body-worn IMUs, from the inclination of the limbs.

Both measure a limb's inclination: a camera as :math:`u \cdot b(t)`, with :math:`u` the vertical and
:math:`b` the bone's direction in its frame; an IMU on the limb as :math:`a \cdot g(t)`, with
:math:`g` the vertical in the sensor and :math:`a` the bone's direction there. The unknown :math:`a`
is constant, and no heading is needed. The time offset is the shift under which a linear
combination of :math:`g` fits :math:`u \cdot b` best:

.. math:: \min_{\tau} \sum_{limbs} n \log \min_a \sum_t (u \cdot b(t) - a \cdot g(t + \tau))^2
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pose_calibration.clocks.joint_delays import CORRELATION_S, UNKNOWN_DELAY, Delay
from pose_calibration.clocks.motion_track import APART_S, GRID_RATE, SLOW_S, Track, without_slow
from pose_core.api import FloatArray
from pose_core.arrays import unit_vectors
from pose_core.finite_numbers import are_known
from pose_core.joints import JOINT_INDEX, SEGMENT_ENDS, other_side

MIN_DURATION_S = 4.0  # [s] of a limb in view
MIN_SWING = 0.03  # [-] standard deviation of a limb's high-passed inclination
DECISIVE = 6.0  # [-] twice the log-likelihood ratio required between the best shift and others
MAX_POINTING = 0.7  # [-] largest cosine between a limb and the line of sight
MIN_EXPLAINED = 0.5  # [-] share of the inclination's variance that the IMU must explain
OWN_REACH_S = 0.2  # [s] half width of the search for each limb's shift about the common one
LAG_FLOOR_S = 0.012  # [s] scatter of the lags of limbs that are measured well
UNEXPLAINED_LAG_S = 0.1  # [s] times what the IMU does not explain: such limbs are measured late
MIN_LIMBS = 3  # [-] in all views together, unless the shift is very clear: one may be wrong
TRACKER_LAG_STDDEV_S = 0.015  # [s] of a tracker's lag between motions
FINE = 3  # [-] half width of the parabola's fit, in steps of the grid
EACH_REACH_S = 0.4  # [s] half width of the search for a single IMU's delay about the common one
EACH_DECISIVE = 30.0  # [-] as DECISIVE, for a single IMU, or fewer limbs
MAX_STDDEV_S = 0.03  # [s] of a single IMU's delay, above which its motion does not determine it
MIN_LATE = 0.7  # [-] quantile: share of the limbs' weight that is later than the result
QUANTILE_LOSS = 1.32  # [-] standard error of that quantile over that of a mean
EXCHANGED_COST = 20.0  # [-] for each pair of exchanged IMUs, in twice the log-likelihood


@dataclass(frozen=True)
class Views:
    """Joints that the cameras measured, and the vertical, both along the reference's axes."""

    tracks: Sequence[Track]  # each relative to its camera; stamps on the reference's clock
    up: FloatArray  # (3,)

    def between(self, begin_s: float, end_s: float) -> "Views":
        """The part from one instant [s] to another, the latter excluded."""
        return Views([track.between(begin_s, end_s) for track in self.tracks], self.up)

    @property
    def span_s(self) -> tuple[float, float]:
        """First and last stamp [s]."""
        stamps = [track.stamps for track in self.tracks if len(track.stamps)]
        return min(float(each[0]) for each in stamps), max(float(each[-1]) for each in stamps)


def limb_ends(track: Track, segment: str, stamps: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Positions of a segment's two ends at instants [s], each (n, 3) [m]."""
    joints = track.at(stamps)
    start, end = (joints[:, JOINT_INDEX[name]] for name in SEGMENT_ENDS[segment])
    return start, end


@dataclass(frozen=True)
class _LimbMisfit:
    """One limb in one view, and the IMU on it, on a grid."""

    misfit: FloatArray  # (shifts,) mean squared residual of the best direction
    count: float  # [-] independent samples
    energy: float  # [1/s²] mean square rate of the explained inclination
    variance: float  # [-] of the inclination


def measure_imu_delay(
    views: Views, verticals: Mapping[str, Track], reach_s: float, centre_s: float = 0.0
) -> Delay:
    """Estimate the delay of the IMUs' stamps behind the views' for the same pose.

    Args:
        views: Joints measured by each camera.
        verticals: The vertical in each IMU, by segment.
        reach_s: Half width of the search [s].
        centre_s: Centre of the search [s].

    Returns:
        The delay [s]; its standard deviation is infinite if the motion does not determine it.
    """
    limbs, shifts = _limbs(views, verticals, reach_s, centre_s)
    cost = _cost(limbs)
    best = _best(cost, shifts)
    if best is None:
        return UNKNOWN_DELAY
    found = [one for limb in limbs if (one := _own_shift(limb, shifts, best)) is not None]
    few_suffice = bool(found) and _best(cost, shifts, EACH_DECISIVE) is not None
    if len(found) < MIN_LIMBS and not few_suffice:
        return UNKNOWN_DELAY
    return _combined(np.array(found))


def unexplained_share(
    views: Views, verticals: Mapping[str, Track], reach_s: float
) -> tuple[float, float]:
    """The share of the limbs' motion along the vertical that the IMUs leave unexplained.

    Args:
        views: Joints measured by each camera.
        verticals: The vertical in each IMU, by segment.
        reach_s: Half width of the search for their delay [s].

    Returns:
        The geometric mean over the limbs, 1 without any, and how many independent samples tell it.
    """
    limbs, _ = _limbs(views, verticals, reach_s, 0.0)
    count = sum(limb.count for limb in limbs)
    if not limbs:
        return 1.0, 0.0
    total = _cost(limbs) - sum(limb.count * np.log(limb.variance) for limb in limbs)
    return float(np.exp(total.min() / count)), count


def exchanged_sides(views: Views, verticals: Mapping[str, Track], reach_s: float) -> dict[str, str]:
    """Segments whose IMU is worn on the other side, each with that one.

    In steady walking, an exchanged pair of IMUs fits half a step later as well as on the other side
    now. So both are compared at the shift that is best for all limbs together.

    Args:
        views: Joints measured by each camera.
        verticals: The vertical in each IMU, by segment.
        reach_s: Half width of the search for the shift [s].
    """

    def limbs(segment: str, named: str) -> list[_LimbMisfit]:
        return _limbs(views, {segment: verticals[named]}, reach_s, 0.0)[0]

    total, gains = np.zeros(1), {}
    for segment in verticals:
        other = other_side(segment)
        if other == segment or other not in verticals:
            total = total + _cost(limbs(segment, segment))
        elif segment < other:
            on_own = [*limbs(segment, segment), *limbs(other, other)]
            on_other = [*limbs(segment, other), *limbs(other, segment)]
            if len(on_own) == len(on_other) > 0:
                cost = _cost(on_own)
                gains[segment, other] = gain = cost - _cost(on_other) - EXCHANGED_COST
                total = total + cost - np.maximum(gain, 0.0)
    best = int(np.argmin(total))
    found: dict[str, str] = {}
    for (one, two), gain in gains.items():
        if gain[best] > 0.0:
            found |= {one: two, two: one}
    return found


def measure_each_delay(
    views: Views, verticals: Mapping[str, Track], centre_s: float
) -> dict[str, Delay]:
    """Estimate the delay of each IMU by itself, from its limb in all views together.

    Args:
        views: Joints measured by each camera.
        verticals: The vertical in each IMU, by segment.
        centre_s: Centre of the search [s].

    Returns:
        The delays of the IMUs whose motion determines them, by segment.
    """
    found = {}
    for segment, vertical in verticals.items():
        limbs, shifts = _limbs(views, {segment: vertical}, EACH_REACH_S, centre_s)
        cost = _cost(limbs)
        best = _best(cost, shifts, EACH_DECISIVE)
        if best is None:
            continue
        left = np.exp((cost[best] - cost.max()) / sum(limb.count for limb in limbs))
        x, curve, vertex_s = _parabola(shifts, cost, best)
        if left > 1.0 - MIN_EXPLAINED or curve < 1.0 / MAX_STDDEV_S**2:
            continue
        estimate_s = float(shifts[best] + np.clip(vertex_s, x[0], x[-1]))
        found[segment] = Delay(estimate_s=estimate_s, stddev_s=float(1.0 / np.sqrt(curve)))
    return found


def _limbs(
    views: Views, verticals: Mapping[str, Track], reach_s: float, centre_s: float
) -> tuple[list[_LimbMisfit], FloatArray]:
    """The limbs whose motion suffices, in all views; and the shifts of their misfits [s]."""
    reach = round(reach_s * GRID_RATE) + FINE
    limbs = [
        limb
        for track in views.tracks
        for segment, each in verticals.items()
        if (limb := _limb(track, views.up, segment, each, reach, centre_s)) is not None
    ]
    return limbs, np.arange(-reach, reach + 1) / GRID_RATE + centre_s


def _cost(limbs: Sequence[_LimbMisfit]) -> FloatArray:
    """Twice the negative log-likelihood of each shift, (shifts,)."""
    return np.asarray(sum(limb.count * np.log(limb.misfit) for limb in limbs))


def _best(cost: FloatArray, shifts: FloatArray, decisive: float = DECISIVE) -> int | None:
    """Index of the best shift; None if it is not clearly better than others, or at the end."""
    if not cost.ndim:  # no limb
        return None
    best = int(np.argmin(cost))
    apart = np.abs(shifts - shifts[best]) > APART_S
    is_decided = not apart.any() or cost[apart].min() - cost[best] >= decisive
    return best if is_decided and FINE <= best < len(shifts) - FINE else None


def _parabola(shifts: FloatArray, values: FloatArray, best: int) -> tuple[FloatArray, float, float]:
    """A parabola through the values about the best shift.

    Returns:
        The shifts relative to the best [s], half its second derivative, and its vertex [s].
    """
    near = slice(best - FINE, best + FINE + 1)
    x = shifts[near] - shifts[best]
    curve, slope, _ = np.polyfit(x, values[near], 2)
    return x, float(curve), float(-0.5 * slope / curve) if curve > 0.0 else 0.0


def _limb(
    track: Track, up: FloatArray, segment: str, vertical: Track, reach: int, centre_s: float
) -> _LimbMisfit | None:
    if len(track.stamps) < 2 or len(vertical.stamps) < 2:
        return None
    grid = np.arange(track.stamps[0], track.stamps[-1], 1.0 / GRID_RATE)
    start, end = limb_ends(track, segment, grid)
    direction = unit_vectors(end - start)
    pointing = np.abs((direction * unit_vectors(end)).sum(axis=1))
    inclination = np.where(pointing < MAX_POINTING, direction @ up, np.nan)
    margin = np.arange(-reach, 0) / GRID_RATE
    wide = np.concatenate([grid[0] + margin, grid, grid[-1] - margin[::-1]]) + centre_s
    is_seen = np.isfinite(inclination)
    fast_inclination = _without_slow(inclination[:, None], is_seen)[:, 0]
    if is_seen.sum() < MIN_DURATION_S * GRID_RATE or fast_inclination[is_seen].std() < MIN_SWING:
        return None
    return _misfits(fast_inclination, is_seen, vertical.at(wide), reach)


def _misfits(
    inclination: FloatArray, is_seen: NDArray[np.bool_], up: FloatArray, reach: int
) -> _LimbMisfit | None:
    """How well an axis of the sensor explains a limb's inclination, at every shift.

    Args:
        inclination: Its high-pass, (n,) [-].
        is_seen: Where it is known, (n,).
        up: The vertical in the sensor's axes, (n + 2 reach, 3); NaN where unknown.
        reach: Largest shift [samples].
    """
    is_up_known = are_known(up)
    fast_up = _without_slow(up, is_up_known)
    misfit = np.empty(2 * reach + 1)
    energy = 0.0
    for shift in range(2 * reach + 1):
        at = slice(shift, shift + len(inclination))
        both = is_seen & is_up_known[at]
        if both.sum() < MIN_DURATION_S * GRID_RATE:
            return None
        g, c = fast_up[at][both], inclination[both]
        normal = g.T @ g + 1e-9 * np.eye(3)
        axis = np.linalg.solve(normal, g.T @ c)
        misfit[shift] = max(float(np.mean((c - g @ axis) ** 2)), 1e-12)
        if misfit[shift] <= misfit[: shift + 1].min():
            rate = np.gradient(fast_up[at] @ axis) * GRID_RATE
            energy = float(np.mean(rate[both] ** 2))
    independent = float(is_seen.sum()) / (CORRELATION_S * GRID_RATE)
    variance = float(np.mean(inclination[is_seen] ** 2))
    return _LimbMisfit(misfit=misfit, count=independent, energy=energy, variance=variance)


def _without_slow(values: FloatArray, known: NDArray[np.bool_]) -> FloatArray:
    """High-pass columns, shape (n, k); 0 where unknown."""
    filled = np.where(known[:, None], values, 0.0)[:, None]
    return without_slow(filled, known[:, None], round(SLOW_S * GRID_RATE))[:, 0]


def _own_shift(limb: _LimbMisfit, shifts: FloatArray, best: int) -> tuple[float, float] | None:
    """A limb's own shift near the common one and its variance [s, s²]; None if undetermined."""
    reach = round(OWN_REACH_S * GRID_RATE)
    first, last = max(best - reach, FINE), min(best + reach + 1, len(shifts) - FINE)
    own = first + int(np.argmin(limb.misfit[first:last]))
    x, curve, vertex_s = _parabola(shifts, limb.misfit, own)
    if own in (first, last - 1) or curve <= 0.0 or limb.energy <= 0.0:
        return None
    least = float(limb.misfit[own - FINE : own + FINE + 1].min())
    unexplained = least / float(limb.misfit.max())
    if unexplained > 1.0 - MIN_EXPLAINED:
        return None
    variance = least / (limb.count * limb.energy) + (UNEXPLAINED_LAG_S * unexplained) ** 2
    return float(shifts[own] + np.clip(vertex_s, x[0], x[-1])), variance


def _combined(found: FloatArray) -> Delay:
    """Weighted quantile of the limbs' shifts, shape (n, 2): errors of limbs are always delays."""
    shift, random = found[np.argsort(found[:, 0])].T
    weight = 1.0 / (random + LAG_FLOOR_S**2)
    share = (np.cumsum(weight) - 0.5 * weight) / weight.sum()
    noise = QUANTILE_LOSS / float(np.sqrt(weight.sum()))
    return Delay(
        estimate_s=float(np.interp(MIN_LATE, share, shift)),
        stddev_s=float(np.hypot(noise, TRACKER_LAG_STDDEV_S)),
        noise_s=noise,
    )
