r"""Delay of each joint in one view behind another, with a resolution finer than a frame.

Where two aligned views differ by a delay :math:`\delta` alone, their difference is the joint's
velocity times the delay, :math:`a - b \approx v \delta`; so each joint gives :math:`\delta` by
linear regression. A tracker may have a different lag for each joint, which is not the clock's: the
joints' delays are weighted samples of the clock's offset, and where they scatter more than those of
two real trackers, the standard deviation is scaled up (Birge, 1932, Phys. Rev. 40(2)).
"""

from dataclasses import dataclass

import numpy as np

from pose_calibration.clocks.motion_track import SLOW_S, without_slow
from pose_core.api import FloatArray
from pose_core.finite_numbers import are_known

LAG_SPREAD_S = 0.004  # [s] between two trackers' lags of a joint; measured: 0.003
CORRELATION_S = 0.4  # [s] correlation time of a joint's error
REACH_S = 0.07  # [s] half width of the velocity's window: a shorter one is dominated by noise
FAR = 3.0  # [-] standard deviations from the median joint beyond which a joint's weight drops
MIN_SIGNAL = 0.5  # [-] of the velocities' energy; a joint at rest determines no delay
MIN_SAMPLES = 30  # [-] of a joint


@dataclass(frozen=True, kw_only=True)
class Delay:
    """Delay of the other view."""

    estimate_s: float  # [s]
    stddev_s: float  # [s] infinite without motion
    noise_s: float = np.inf  # [s] part of it that differs between windows of motion


UNKNOWN_DELAY = Delay(estimate_s=0.0, stddev_s=np.inf)


def estimate_delay(stamps: FloatArray, a: FloatArray, b: FloatArray) -> Delay:
    """Estimate the delay of one view behind another, both in the same frame.

    Args:
        stamps: Instants [s], ascending, shape (n,).
        a: Joints [m] in the one view, shape (n, 15, 3), NaN where unknown.
        b: The same in the other.
    """
    if len(stamps) < MIN_SAMPLES:
        return UNKNOWN_DELAY
    step = float(np.median(np.diff(stamps)))
    width = max(3, round(SLOW_S / step))
    reach = max(1, round(REACH_S / step))
    velocity = _velocity(stamps, 0.5 * (a + b), reach)
    apart = _velocity(stamps, a - b, reach)
    known = are_known(velocity + a - b)
    quick = without_slow(np.where(known[..., None], a - b, 0.0), known, width)
    v = without_slow(np.where(known[..., None], velocity, 0.0), known, width)
    measured = (v**2).sum(axis=(0, 2))
    # Noise in the velocities biases the delay towards zero (errors in variables). Independent noise
    # of the two views has four times the energy in their difference that it has in their mean.
    energy = measured - 0.25 * np.where(known[..., None], apart**2, 0.0).sum(axis=(0, 2))
    usable = (known.sum(axis=0) >= MIN_SAMPLES) & (energy > MIN_SIGNAL * measured)
    if not usable.any():
        return UNKNOWN_DELAY
    energy, quick, v, known = energy[usable], quick[:, usable], v[:, usable], known[:, usable]
    delay = (v * quick).sum(axis=(0, 2)) / energy
    left = (quick - v * delay[:, None]) ** 2
    # Fast joints are tracked worst: the error is weighted like the motion.
    share = (v**2).sum(axis=2) / measured[usable]
    noise = (left.sum(axis=2) * share).sum(axis=0) / 3.0
    random = noise / energy * max(1.0, CORRELATION_S / step)
    variance = random + LAG_SPREAD_S**2
    off = np.abs(delay - np.median(delay)) / np.sqrt(variance)
    weight = np.minimum(1.0, FAR / np.maximum(off, 1e-9)) / variance
    estimate = float((weight * delay).sum() / weight.sum())
    scatter = float((weight * (delay - estimate) ** 2).sum()) / max(1, len(delay) - 1)
    return Delay(
        estimate_s=estimate,
        stddev_s=float(np.sqrt(max(1.0, scatter) / weight.sum())),
        noise_s=float(np.sqrt((weight**2 * random).sum()) / weight.sum()),
    )


def _velocity(stamps: FloatArray, positions: FloatArray, reach: int) -> FloatArray:
    """Velocities [m/s] over ``reach`` samples to either side, NaN at the ends."""
    velocity = np.full_like(positions, np.nan)
    step = (stamps[2 * reach :] - stamps[: -2 * reach])[:, None, None]
    velocity[reach:-reach] = (positions[2 * reach :] - positions[: -2 * reach]) / step
    return velocity
