"""Pose of the reference sensor relative to the floor."""

from dataclasses import dataclass

import numpy as np

from pose_core.arrays import FloatArray


@dataclass(frozen=True, kw_only=True)
class FloorEstimate:
    """Pose of the reference sensor relative to the floor."""

    T_map_reference: FloatArray  # (4, 4)
    source: str  # source of the vertical
    up_stddev: float  # [rad]
    height_stddev: float  # [m]

    @property
    def height(self) -> float:
        """Height of the reference sensor above the floor [m]."""
        return float(self.T_map_reference[2, 3])

    @property
    def tilt(self) -> float:
        """Downward tilt [rad] of the reference sensor's viewing direction."""
        return float(-np.arcsin(np.clip(self.T_map_reference[2, 2], -1.0, 1.0)))
