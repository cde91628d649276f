"""Detects a state that faces backwards, from the knees, which bend forwards only.

A tracker that sees a person from behind may exchange left and right. If the person turns meanwhile
and joints are lost, the filter may take back for front. Then it exchanges the sides of frames whose
sides are right (:mod:`pose_core.kernels.left_right_swaps`), and stays as it is. But bent knees
point forwards, whichever leg is called left.
"""

import numpy as np
from numpy.typing import NDArray

from pose_core.arrays import FloatArray
from pose_core.body.trunk import trunk_axes
from pose_core.filter.frame import CameraFrame
from pose_core.joints import LEGS, TrackingState
from pose_core.kernels.compiling import compiled_in_place, type_specialised

MIN_BEND = 0.08  # [m] of the knee from the line between hip and foot: bent by about 25°
MIN_COSINE = 0.5  # [-] between a knee's direction and the forward axis
BACKWARDS_S = 0.5  # [s] bound of the sum either way; at the lower one, the state is wrong


class FacingCheck:
    """Sums the time for which bent knees point forwards, minus that for which they do not."""

    def __init__(self) -> None:
        self._forwards_s = 0.0
        self._knees_forwards = type_specialised(knees_forwards)

    def restart(self) -> None:
        """Forget the state so far."""
        self._forwards_s = 0.0

    def faces_backwards(
        self, frame: CameraFrame, R_map_pelvis: FloatArray, passed_s: float
    ) -> bool:
        """Add a frame; whether the state faces backwards, and the frame's own sides do not.

        Args:
            frame: A camera's frame, as measured.
            R_map_pelvis: The state's, (3, 3).
            passed_s: Time that the frame stands for [s].
        """
        knees = self._knees_forwards(frame.positions, frame.tracking_state, R_map_pelvis)
        sum_s = self._forwards_s + ((knees > 0) - (knees < 0)) * passed_s
        self._forwards_s = min(max(sum_s, -BACKWARDS_S), BACKWARDS_S)
        if knees >= 0 or self._forwards_s > -BACKWARDS_S:
            return False
        R_measured = np.ascontiguousarray(trunk_axes(frame.positions))
        return self._knees_forwards(frame.positions, frame.tracking_state, R_measured) > 0


@compiled_in_place
def knees_forwards(
    joints: FloatArray, tracking_state: NDArray[np.uint8], R_map_pelvis: FloatArray
) -> int:
    """Number of bent knees that point forwards, minus those that point backwards.

    Args:
        joints: In map, (15, 3) [m].
        tracking_state: (15,).
        R_map_pelvis: (3, 3), x forwards.
    """
    count = 0
    for hip, knee, foot in LEGS:
        least = min(tracking_state[hip], tracking_state[knee], tracking_state[foot])
        if least < TrackingState.TRACKED:
            continue
        along = squared = 0.0
        for axis in range(3):
            bend = joints[knee, axis] - 0.5 * (joints[hip, axis] + joints[foot, axis])
            along += bend * R_map_pelvis[axis, 0]
            squared += bend * bend
        if squared > MIN_BEND**2:  # false for NaN
            count += (along > MIN_COSINE * np.sqrt(squared)) - (
                along < -MIN_COSINE * np.sqrt(squared)
            )
    return count
