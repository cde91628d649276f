"""Detects a state whose legs or arms are exchanged, from frames that contradict it alike.

A tracker that exchanges the legs while the filter starts, or for longer than the filter resists,
may leave them exchanged in the state. Then the sides of right frames are exchanged to fit the state
(:mod:`pose_core.kernels.left_right_swaps`), and it stays as it is. But in a right frame hips and
shoulders have their left on the same side, and two trackers hardly make the same mistake all the
time. Exchanging arms and legs together is different: trackers do that for as long as they see a
person's back.
"""

from pose_core.filter.frame import CameraFrame
from pose_core.joints import JOINT_PAIRS

CROSSED_S = 1.0  # [s] of two cameras or more
CROSSED_ALONE_S = 2.0  # [s] of a camera that is alone: it may be wrong for a while


class CrossedLimbsCheck:
    """Sums the time for which the frames of all cameras had arms or legs exchanged."""

    def __init__(self) -> None:
        self._crossed_s = 0.0
        self._sensors: set[int] = set()

    def restart(self) -> None:
        """Forget the state so far."""
        self._crossed_s = 0.0
        self._sensors.clear()

    def is_crossed(self, frame: CameraFrame, swaps: int, passed_s: float) -> bool:
        """Add a frame; whether the state is wrong.

        Args:
            frame: A camera's frame, as measured.
            swaps: Number of groups, arms and legs, that were exchanged to fit the state.
            passed_s: Time that the frame stands for [s].
        """
        if swaps != 1:
            self.restart()
            return False
        pairs = (frame.positions[JOINT_PAIRS[name]] for name in ("hip", "shoulder"))
        hips, shoulders = (left - right for left, right in pairs)
        if not hips @ shoulders > 0.0:  # the frame is wrong itself, or NaN
            return False
        self._crossed_s += passed_s
        self._sensors.add(frame.sensor)
        return self._crossed_s > (CROSSED_S if len(self._sensors) > 1 else CROSSED_ALONE_S)
