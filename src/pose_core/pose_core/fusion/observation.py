"""What the sensors say of one instant."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pose_core.body.shape import BodyShape
from pose_core.imu.imu_history import ImuStates
from pose_core.streams.samples import FloatArray


@dataclass(frozen=True, kw_only=True)
class Observation:
    """What the sensors say of one instant, in ``map``, and of whom."""

    stamp_ns: int  # [ns]
    newest_ns: int  # [ns] stamp of the newest sample of any source that had come by then
    shape: BodyShape  # the person's measures; another object is another body
    positions: FloatArray  # (sensors, 15, 3) [m]; NaN where a sensor says nothing
    tracking_state: NDArray[np.uint8]  # (sensors, 15), values of TrackingState
    cameras: FloatArray  # (sensors, 3) [m] where the sensors stand; NaN not placed
    readings: ImuStates  # of all IMUs, each in its own world
