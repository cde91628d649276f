"""Detects a state whose legs or arms are exchanged, from frames that all contradict it alike.

A tracker that exchanges the legs while the filter starts, or for longer than the filter resists,
may leave them exchanged in the state. Then the sides of right frames are exchanged to fit the state
(:mod:`pose_core.kernels.left_right_swaps`), and it stays as it is. But two trackers hardly exchange
the same limbs all the time. Exchanging arms and legs together is different: trackers do that for
as long as they see a person's back.
"""

CROSSED_S = 0.7  # [s]


class CrossedLimbsCheck:
    """Sums the time for which all frames, of two cameras or more, had arms or legs exchanged."""

    def __init__(self) -> None:
        self._crossed_s = 0.0
        self._sensors: set[int] = set()

    def restart(self) -> None:
        """Forget the state so far."""
        self._crossed_s = 0.0
        self._sensors.clear()

    def is_crossed(self, sensor: int, swaps: int, passed_s: float) -> bool:
        """Add a frame; whether the state is wrong.

        Args:
            sensor: The frame's camera.
            swaps: Number of groups, arms and legs, that were exchanged to fit the state.
            passed_s: Time that the frame stands for [s].
        """
        if swaps != 1:
            self.restart()
            return False
        self._crossed_s += passed_s
        self._sensors.add(sensor)
        return len(self._sensors) > 1 and self._crossed_s > CROSSED_S
