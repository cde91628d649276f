"""A clip: captured motion of one person at one rate."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import make_interp_spline
from scipy.spatial.transform import Rotation, Slerp

from pose_core.arrays import FloatArray

RATE = 60.0  # [Hz] of all clips


@dataclass(frozen=True, kw_only=True)
class Clip:
    """Captured motion of one person, n frames at :data:`RATE`."""

    name: str
    positions: FloatArray  # (n, 15, 3) [m]
    rotations: Mapping[str, Rotation]  # n of each segment: world from segment

    def __len__(self) -> int:
        return len(self.positions)


def resampled(
    name: str, times: FloatArray, positions: FloatArray, rotations: Mapping[str, Rotation]
) -> Clip:
    """Resample motion of any rate to a clip.

    Args:
        name: Name of the clip.
        times: Times of the frames, from zero [s], (m,).
        positions: Joint positions, (m, 15, 3) [m].
        rotations: Rotation of each segment, world from segment, m each.
    """
    grid = np.arange(int(times[-1] * RATE + 1e-6) + 1) / RATE
    grid = np.minimum(grid, times[-1])
    path = make_interp_spline(times, positions, k=min(3, len(times) - 1))
    return Clip(
        name=name,
        positions=path(grid),
        rotations={segment: Slerp(times, each)(grid) for segment, each in rotations.items()},
    )
