"""Vectors over time, prepared for the estimation of clock offsets."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pose_core.api import FloatArray, SkeletonSample, longest_gap_s
from pose_core.joints import JOINTS
from pose_core.stamps import NS_PER_S

KERNEL = np.array([1.0, 2.0, 3.0, 2.0, 1.0]) / 9.0  # [-] weights of neighbouring samples
SLOW_S = 2.0  # [s] slower differences are not due to a delay
SEARCHED_S = 60.0  # [s] used of a longer recording for a search: a drift blurs the minimum
GRID_RATE = 50.0  # [Hz] of the shifts that are searched
APART_S = 0.15  # [s] shifts closer than this to the best one count as the same


@dataclass(frozen=True)
class Track:
    """Vectors over time: one sensor's joints, or the vertical in one IMU."""

    stamps: FloatArray  # (n,) [s], ascending
    values: FloatArray  # (n, …, 3): joints [m], NaN if not tracked; or unit vectors

    def at(self, stamps: FloatArray) -> FloatArray:
        """Interpolate linearly at other instants.

        Args:
            stamps: The instants, (m,) [s].

        Returns:
            Shape (m, …, 3); NaN in gaps and outside.
        """
        own, values = self.stamps, self.values
        after = np.clip(np.searchsorted(own, stamps), 1, len(own) - 1)
        step = own[after] - own[after - 1]
        share = (stamps - own[after - 1]) / step
        shares = share.reshape(-1, *[1] * (values.ndim - 1))
        result: FloatArray = values[after - 1] + shares * (values[after] - values[after - 1])
        result[(share < 0.0) | (share > 1.0) | (step > self.max_gap_s)] = np.nan
        return result

    @cached_property
    def max_gap_s(self) -> float:
        """Longest gap [s] to interpolate across."""
        return longest_gap_s(
            float(np.median(np.diff(self.stamps))) if len(self.stamps) > 1 else 0.0
        )

    def between(self, begin_s: float, end_s: float) -> "Track":
        """The part from one instant [s] to another, the latter excluded."""
        first, last = np.searchsorted(self.stamps, [begin_s, end_s])
        return Track(self.stamps[first:last], self.values[first:last])


def track_of(samples: Sequence[SkeletonSample], begin_ns: int) -> Track:
    """Track of a sensor's samples, stamps ascending; seconds since ``begin_ns``, TRACKED joints."""
    stamps_ns = np.array([sample.stamp_ns - begin_ns for sample in samples], np.int64)
    positions = np.array([sample.tracked for sample in samples]).reshape(-1, len(JOINTS), 3)
    ascending = np.diff(stamps_ns, prepend=-(2**62)) > 0
    return _smoothed(Track(stamps_ns[ascending] / NS_PER_S, positions[ascending]))


def without_slow(values: FloatArray, known: NDArray[np.bool_], width: int) -> FloatArray:
    """High-pass values (n, joints, 3): subtract the moving mean of the known ones; 0 if unknown."""
    # Imported here: scipy takes half a second to load, not at a node's start.
    from scipy.ndimage import uniform_filter1d

    count = uniform_filter1d(known.astype(float), width, axis=0, mode="nearest")
    mean = uniform_filter1d(values, width, axis=0, mode="nearest")
    mean = mean / np.maximum(count, 1e-6)[..., None]
    return np.where(known[..., None], values - mean, 0.0)


def _smoothed(track: Track) -> Track:
    """Weighted means of neighbouring samples, and of their stamps.

    Interpolation halfway between two noisy samples halves the variance of their noise: without
    smoothing, the estimate would be biased to shifts of half a sample.
    """
    stamps, positions = track.stamps, track.values
    count = len(stamps) - len(KERNEL) + 1
    if count < 1:
        return Track(np.empty(0), np.empty((0, len(JOINTS), 3)))
    windows = [slice(first, first + count) for first in range(len(KERNEL))]
    mean_stamps = sum(w * stamps[part] for w, part in zip(KERNEL, windows, strict=True))
    mean = sum(w * positions[part] for w, part in zip(KERNEL, windows, strict=True))
    longest = np.maximum.reduce([np.diff(stamps)[part] for part in windows[:-1]])
    pause = longest > track.max_gap_s
    mean = np.where(pause[:, None, None], np.nan, mean)
    return Track(np.asarray(mean_stamps), mean)
