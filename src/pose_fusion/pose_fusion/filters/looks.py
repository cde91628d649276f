"""What goes into an update of the segment filter, and what comes out."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pose_fusion.kernels.links import LinkLooks as LinkLooks
from pose_fusion.streams.samples import FloatArray


@dataclass(frozen=True, kw_only=True)
class CameraLook:
    """One camera's view of one instant."""

    positions: FloatArray  # (15, 3) [m] in map; NaN unseen
    tracking_state: NDArray[np.uint8]  # (15,)
    camera: FloatArray  # (3,) [m] in map
    offsets: FloatArray  # (15, 3) [m] the tracker's own, in the axes of the root's heading
    delay_s: float  # [s] how far before the filter's instant this was


@dataclass(frozen=True, kw_only=True)
class UpdateReport:
    """What an update did."""

    distance: FloatArray  # (15,) squared Mahalanobis distance of each joint; NaN unseen
    information: FloatArray  # (2, links, 3, 3) [1/rad²] of the Kinects and of the IMUs
    flipped: int  # limbs turned by half a turn
