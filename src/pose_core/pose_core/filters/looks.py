"""What goes into an update of the segment filter, and what comes out."""

from dataclasses import dataclass

from pose_core.kernels.camera import CameraLooks as CameraLooks
from pose_core.kernels.correction import Outcome as Outcome
from pose_core.kernels.links import LinkLooks as LinkLooks
from pose_core.streams.samples import FloatArray


@dataclass(frozen=True, kw_only=True)
class UpdateReport:
    """What an update did."""

    outcome: Outcome
    distance: FloatArray  # (15,) squared Mahalanobis distance of each joint; NaN unseen
    information: FloatArray  # (2, links, 3, 3) [1/rad²] of the Kinects and of the IMUs
