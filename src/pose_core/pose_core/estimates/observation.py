"""All measurements at one instant."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pose_core.arrays import FloatArray
from pose_core.body.shape import BodyShape
from pose_core.imu.imu_history import ImuMeasurements


@dataclass(frozen=True, kw_only=True)
class Observation:
    """All measurements of one person at one instant, in ``map``."""

    stamp_ns: int  # [ns]
    newest_ns: int  # [ns] stamp of the newest sample of any source received by then
    shape: BodyShape  # the person's body measures; another object is another body
    positions: FloatArray  # (sensors, 15, 3) [m]; NaN where not measured
    tracking_state: NDArray[np.uint8]  # (sensors, 15), values of TrackingState
    cameras: FloatArray  # (sensors, 3) [m] positions of the sensors; NaN if unknown
    imus: ImuMeasurements  # of all IMUs, each in its own reference frame
