"""A pose that never jumps: a large correction is taken over gradually.

When a sensor comes or goes, a limb is found elsewhere or the filter starts anew, the state jumps.
What goes out then keeps its place and glides to the state: the difference, beyond a little that
may show at once, decays. Corrections at other times are quick movements: they show at once, but for
what no person does. Late frames correct without anything going out: what may show is counted from
one pose that goes out to the next.
"""

from collections.abc import Iterable

import numpy as np

from pose_fusion.filters.segment_state import SegmentState
from pose_fusion.kernels.rotations import turn_all, turns_between
from pose_fusion.streams.samples import FloatArray

DECAY_S = 0.12  # [s] time constant of the glide
NS_PER_S = 1_000_000_000
EVENT_NS = NS_PER_S // 10  # [ns] for which an event's corrections come
ABSENT_NS = NS_PER_S // 5  # [ns] of silence, after which a source that speaks is an event
LARGEST_TURN = np.radians(2.0)  # [rad] that one update may correct at once, after an event
EVER_LARGER = 12.0  # [-] times as much at other times
TURN_TIME_S = 0.03  # [s] of a link's own rate, by which that may be more
LARGEST_SHIFT = 0.02  # [m] likewise, of the root
SHIFT_TIME_S = 0.03  # [s] likewise, of its velocity
NEGLIGIBLE_TURN = np.radians(0.05)
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
    """Follows a filter's states without their jumps."""

    def __init__(self) -> None:
        self._turns: FloatArray | None = None  # (links, 3) [rad] in map: out = exp(turn) state
        self._shift = np.zeros(3)  # [m]
        self._shown_turns: FloatArray | float = 0.0  # [rad] (links, 1) of corrections at once
        self._shown_shift = 0.0  # [m] likewise, since a pose went out

    def predict(self, dt_s: float) -> None:
        """Glide on for ``dt_s`` [s]."""
        keep = float(np.exp(-dt_s / DECAY_S))
        if self._turns is not None:
            self._turns = keep * self._turns
        self._shift = keep * self._shift

    def follow(self, before: SegmentState | None, after: SegmentState, eventful: bool) -> None:
        """Take up a correction.

        Args:
            before: The state as predicted, just before; None: nothing has gone out yet.
            after: The corrected state of the same instant.
            eventful: Whether something has just happened that makes the state jump.
        """
        if before is None:
            self._turns, self._shift = np.zeros((len(after.rotations), 3)), np.zeros(3)
            return
        turns = np.zeros((len(after.rotations), 3)) if self._turns is None else self._turns
        shown, missing = np.empty_like(before.rotations), np.empty_like(turns)
        turn_all(turns, 1.0, before.rotations, shown)
        # What would go out if nothing glided, against what went out.
        turns_between(shown, after.rotations, missing)
        rate = np.linalg.norm(before.rates, axis=1, keepdims=True)
        times = 1.0 if eventful else EVER_LARGER
        largest_turn = times * (LARGEST_TURN + TURN_TIME_S * rate)
        self._turns = _beyond(missing, turns, np.maximum(largest_turn - self._shown_turns, 0.0))
        at_once = np.linalg.norm(missing - self._turns, axis=1, keepdims=True)
        self._shown_turns = self._shown_turns + at_once
        shift = before.position + self._shift - after.position
        largest = LARGEST_SHIFT + SHIFT_TIME_S * np.linalg.norm(before.velocity)
        left = max(times * float(largest) - self._shown_shift, 0.0)
        self._shift = _beyond(shift[None], self._shift[None], left)[0]
        self._shown_shift = self._shown_shift + float(np.linalg.norm(shift - self._shift))

    def shown(self, state: SegmentState) -> SegmentState:
        """What goes out for a state."""
        self._shown_turns = self._shown_shift = 0.0
        if self._turns is None or self._is_over():
            return state
        glided = state.copy()
        turn_all(self._turns, 1.0, state.rotations, glided.rotations)
        glided.position = state.position + self._shift
        return glided

    def _is_over(self) -> bool:
        turns = np.zeros(1) if self._turns is None else np.linalg.norm(self._turns, axis=1)
        return bool(
            np.all(turns < NEGLIGIBLE_TURN) and np.linalg.norm(self._shift) < NEGLIGIBLE_SHIFT
        )


def _beyond(missing: FloatArray, gliding: FloatArray, largest: float | FloatArray) -> FloatArray:
    """What is to glide: all that was gliding, and of each new correction what is beyond a limit.

    Args:
        missing: Difference between what went out and the state, shape (n, 3).
        gliding: Of that, what was gliding already, shape (n, 3).
        largest: New correction that may show at once; a number or shape (n, 1).
    """
    correction = missing - gliding
    size = np.linalg.norm(correction, axis=1, keepdims=True)
    share = np.maximum(0.0, 1.0 - largest / np.maximum(size, 1e-12))
    return np.asarray(gliding + share * correction)
