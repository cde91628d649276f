"""A pose that never jumps: a large correction is taken over gradually.

When a sensor comes or goes, a limb is found elsewhere or the filter starts anew, the state jumps.
What goes out then keeps its place and glides to the state: the difference, beyond a little that
may show at once, decays. Corrections at other times are quick movements: they show at once, but for
what no person does. Late frames correct without anything going out: what may show is counted from
one pose that goes out to the next.
"""

from collections.abc import Iterable
from dataclasses import replace
from math import exp

import numpy as np

from pose_common.stamps import NS_PER_S
from pose_fusion.filters.segment_state import SegmentState
from pose_fusion.kernels.gliding import Limits, is_over, take_up
from pose_fusion.kernels.placing import Pose
from pose_fusion.kernels.rotations import turn_all

DECAY_S = 0.12  # [s] time constant of the glide
EVENT_NS = NS_PER_S // 10  # [ns] for which an event's corrections come
ABSENT_NS = NS_PER_S // 5  # [ns] of silence, after which a source that speaks is an event
AFTER_AN_EVENT = Limits(
    turn=float(np.radians(2.0)), turn_time_s=0.03, shift=0.02, shift_time_s=0.03
)
"""What one update may correct at once, after an event."""
EVER_LARGER = 12.0  # [-] times as much at other times
AT_OTHER_TIMES = Limits(*(EVER_LARGER * limit for limit in AFTER_AN_EVENT))
NEGLIGIBLE_TURN = float(np.radians(0.05))
NEGLIGIBLE_SHIFT = 0.0005  # [m]


class Sources:
    """Notices when a source of information, a camera or an IMU, comes or goes."""

    def __init__(self) -> None:
        self._heard_ns: dict[str, int] = {}
        self._event_ns: int | None = None

    def is_eventful(self, stamp_ns: int, names: Iterable[str], event: bool) -> bool:
        """Whether an event is so recent that its corrections still come.

        Args:
            stamp_ns: The instant.
            names: Sources that speak of it.
            event: Whether something else has just happened.
        """
        gone = [n for n, ns in self._heard_ns.items() if not 0 <= stamp_ns - ns <= ABSENT_NS]
        for name in gone:
            del self._heard_ns[name]
        new = [name for name in names if name not in self._heard_ns]
        self._heard_ns.update(dict.fromkeys(names, stamp_ns))
        if event or gone or new:
            self._event_ns = stamp_ns
        return self._event_ns is not None and 0 <= stamp_ns - self._event_ns <= EVENT_NS


class Handover:
    """Follows a filter's states without their jumps.

    Args:
        links: Number of the body's links.
    """

    def __init__(self, links: int) -> None:
        self._turns = np.zeros((links, 3))  # [rad] in map: out = exp(turn) state
        self._shift = np.zeros(3)  # [m]
        self._at_once = np.zeros(links + 1)  # [rad], [m] corrections since a pose went out

    def predict(self, dt_s: float) -> None:
        """Glide on for ``dt_s`` [s]."""
        keep = exp(-dt_s / DECAY_S)
        self._turns = keep * self._turns  # not in place: a copy may go on by itself
        self._shift = keep * self._shift

    def follow(self, before: Pose | None, after: Pose, eventful: bool) -> None:
        """Take up a correction.

        Args:
            before: The pose as predicted, just before; None: nothing has gone out yet.
            after: The corrected pose of the same instant.
            eventful: Whether something has just happened that makes the state jump.
        """
        if before is None:
            self._turns, self._shift = np.zeros_like(self._turns), np.zeros(3)
            return
        limits = AFTER_AN_EVENT if eventful else AT_OTHER_TIMES
        take_up(before, after, limits, self._turns, self._shift, self._at_once)

    def shown(self, state: SegmentState) -> SegmentState:
        """What goes out for a state; shares what is not changed with it."""
        self._at_once = np.zeros_like(self._at_once)
        if is_over(self._turns, self._shift, NEGLIGIBLE_TURN, NEGLIGIBLE_SHIFT):
            return state
        rotations = np.empty_like(state.rotations)
        turn_all(self._turns, 1.0, state.rotations, rotations)
        return replace(state, rotations=rotations, position=state.position + self._shift)
