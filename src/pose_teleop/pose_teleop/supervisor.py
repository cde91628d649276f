"""Whether the robot may follow: a state machine that only ever starts softly.

::

    WAITING ── well and held for settle_time ──► SOFT_START ── at the person's pose ──► FOLLOWING
       ▲                                             │                                     │
       └── well again ── FROZEN ◄── at rest ── SLOWING ◄──────── anything is wrong ────────┘
"""

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

from pose_core.stamps import NS_PER_S


class State(Enum):
    """What the robot does."""

    WAITING = "waiting"  # it is not commanded
    SOFT_START = "soft start"  # it goes slowly to the person's pose
    FOLLOWING = "following"  # it follows, at a speed that ramps up
    SLOWING = "slowing"  # it brakes
    FROZEN = "frozen"  # it is commanded to stand still


class Fault(Enum):
    """Why the robot may not follow, in the order in which they are told."""

    NOT_HELD = "the dead-man input is not held"
    NO_ROBOT = "the robot's joint states do not come"
    NO_URDF = "the person's urdf has not come"
    STALE = "joint states or estimates are stale"
    CLOCK = "stamps are ahead of the clock or run backwards"
    NOT_FINITE = "an angle is not a number"
    INCOMPLETE = "an angle of the arm is missing"
    JUMPED = "an angle has jumped"
    UNCERTAIN = "the deviation of the hand's place is too large"
    LOST = "the person is lost"
    PERSON_CHANGED = "the person has changed"
    LAGS = "the robot is far from its command"


SOFT_S = 3.0  # [s] after which a soft start becomes faster
LATCHED = frozenset({Fault.PERSON_CHANGED, Fault.LAGS})
"""After these the dead-man input must be let go before the robot starts again."""


@dataclass(frozen=True, kw_only=True)
class Situation:
    """What the supervisor judges by, at one instant."""

    now_ns: int  # [ns] of a clock that never jumps
    fault: Fault | None
    is_held: bool
    is_at_rest: bool  # the command
    distance: Callable[[], float]  # [rad] largest of a joint from the person's pose


class Supervisor:
    """The state machine.

    Attributes:
        state: What the robot does.
        fault: What stopped it last, or keeps it from starting; None while it follows.

    Args:
        settle_s: How long all must be well before the start [s].
        soft_velocity: Of a joint in the soft start [rad/s].
        full_velocity: Of the fastest joint [rad/s].
        soft_tolerance: Distance at which the soft start is over [rad].
        ramp_s: From the soft start's velocity to the full one [s].
        must_let_go: Whether there is a dead-man input that can be let go.
    """

    def __init__(
        self,
        *,
        settle_s: float,
        soft_velocity: float,
        full_velocity: float,
        soft_tolerance: float,
        ramp_s: float,
        must_let_go: bool,
    ) -> None:
        self.state = State.WAITING
        self.fault: Fault | None = Fault.NOT_HELD
        self._settle_ns = round(settle_s * NS_PER_S)
        self._ramp_ns = round(ramp_s * NS_PER_S)
        self._soft_velocity, self._full_velocity = soft_velocity, full_velocity
        self._soft_tolerance = soft_tolerance
        self._can_latch = must_let_go
        self._is_latched = False
        self._well_since_ns: int | None = None
        self._moving_since_ns = 0  # in this state
        self._begun_at = soft_velocity  # the velocity at which following began
        self._now_ns = 0

    @property
    def fastest(self) -> float:
        """What no joint's velocity should exceed now [rad/s].

        A soft start that has not caught up with a person who moves on becomes faster.
        """
        since_ns = self._now_ns - self._moving_since_ns
        if self.state is State.FOLLOWING:
            share = min(1.0, since_ns / max(self._ramp_ns, 1))
            return self._begun_at + (self._full_velocity - self._begun_at) * share
        late_s = max(0.0, since_ns / NS_PER_S - SOFT_S)
        return min(self._soft_velocity * (1.0 + late_s), self._full_velocity)

    def update(self, situation: Situation) -> State:
        """Judge anew; the state from now on."""
        self._now_ns = situation.now_ns
        fault = situation.fault
        if fault is None and not situation.is_held:
            fault = Fault.NOT_HELD
        self._latch(fault, situation.is_held)
        is_well = fault is None and not self._is_latched
        if not is_well:
            self._well_since_ns = None
            self.fault = fault or self.fault
        elif self._well_since_ns is None:
            self._well_since_ns = situation.now_ns
        moves = self.state in (State.SOFT_START, State.FOLLOWING)
        if moves and not is_well:
            self.state = State.SLOWING
        elif self.state is State.SLOWING and situation.is_at_rest:
            self.state = State.FROZEN
        elif self.state in (State.FROZEN, State.WAITING):
            self._wait(is_well)
        elif self.state is State.SOFT_START and situation.distance() < self._soft_tolerance:
            self._begun_at = self.fastest
            self.state, self._moving_since_ns = State.FOLLOWING, situation.now_ns
        return self.state

    def _latch(self, fault: Fault | None, is_held: bool) -> None:
        if fault in LATCHED and self._can_latch and self.state is not State.WAITING:
            self._is_latched = True
        elif not is_held:
            self._is_latched = False

    def _wait(self, is_well: bool) -> None:
        if not is_well:
            return
        assert self._well_since_ns is not None
        if self.state is State.FROZEN:
            self.state = State.WAITING
        elif self._now_ns - self._well_since_ns >= self._settle_ns:
            self.state, self.fault = State.SOFT_START, None
            self._moving_since_ns = self._now_ns
