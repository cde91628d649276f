"""Why a filter starts anew."""

from enum import Enum


class RestartCause(Enum):
    """Cause of a restart; the value is the name of its counter."""

    GAP = "filter_restarts_gap"  # no sensor sent anything for long
    TIME_JUMP = "filter_restarts_time_jump"  # the stamps jumped back
    DIVERGED = "filter_restarts_diverged"  # the person is away from the prediction for long
    BACKWARDS = "filter_restarts_backwards"  # the state takes back for front
    CROSSED = "filter_restarts_crossed"  # the state's arms or legs are exchanged
    NUMERICAL = "filter_restarts_numerical"  # a result that is not finite
