"""Checks of a filter's state against the cameras' frames: whether it has to be restarted."""

from math import isnan

from pose_core.filter.crossed_limbs_check import CrossedLimbsCheck
from pose_core.filter.facing_check import FacingCheck
from pose_core.filter.frame import CameraFrame
from pose_core.filter.restart_cause import RestartCause
from pose_core.filter.state import FilterState
from pose_core.filter.tracker_errors import MAX_STEP_S

DIVERGED_SHARE = 0.5  # [-] of joints far from their prediction: the person is lost
DIVERGED_NS = 250_000_000  # [ns] after which the filter is restarted


class StateChecks:
    """Whether the state faces backwards, has its limbs crossed, or has lost the person."""

    def __init__(self) -> None:
        self._facing = FacingCheck()
        self._crossed = CrossedLimbsCheck()
        self._diverged_since_ns: int | None = None

    def restart(self) -> None:
        """Forget the state so far."""
        self._facing.restart()
        self._crossed.restart()
        self._diverged_since_ns = None

    def check_sides(
        self, measured: CameraFrame, swaps: int, state: FilterState
    ) -> RestartCause | None:
        """What is wrong with the sides of the state, by a camera's frame; None if nothing is.

        Args:
            measured: The frame, as measured.
            swaps: Number of groups, arms and legs, that were exchanged to fit the state.
            state: The filter's state, predicted to the frame's instant.
        """
        silent_s = state.views.silent_s
        passed_s = min(silent_s[measured.sensor], MAX_STEP_S) / len(silent_s)
        is_crossed = self._crossed.is_crossed(measured, swaps, passed_s)
        if self._facing.faces_backwards(measured, state.pose.rotations[0], passed_s):
            return RestartCause.BACKWARDS
        return RestartCause.CROSSED if is_crossed else None

    def has_diverged(self, stamp_ns: int, lost_share: float) -> bool:
        """Whether the filter has lost the person for too long.

        Args:
            stamp_ns: Instant of the update [ns].
            lost_share: Share of joints far from their prediction [-]; NaN: none was measured.
        """
        if isnan(lost_share):
            return False
        if lost_share <= DIVERGED_SHARE:
            self._diverged_since_ns = None
            return False
        if self._diverged_since_ns is None or stamp_ns < self._diverged_since_ns:
            self._diverged_since_ns = stamp_ns
        return stamp_ns - self._diverged_since_ns > DIVERGED_NS
