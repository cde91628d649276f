"""State machine that starts and stops the robot; every start is a soft start.

::

    WAITING ── well and held for settle_time ──► SOFT_START ── at the person's pose ──► FOLLOWING
       ▲                                             │                                     │
       └── well again ── FROZEN ◄── at rest ── SLOWING ◄──────── anything is wrong ────────┘
"""

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

from pose_core.stamps import NS_PER_S
from pose_teleop.parameters import ArmParameters


class State(Enum):
    """State of the robot."""

    WAITING = "waiting"  # not commanded
    SOFT_START = "soft start"  # moves slowly to the person's pose
    FOLLOWING = "following"  # follows the person, with an increasing velocity limit
    SLOWING = "slowing"  # brakes
    FROZEN = "frozen"  # commanded to stand still


class StopReason(Enum):
    """Reason why the robot may not follow, in the order of priority."""

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


SOFT_S = 3.0  # [s] after which the velocity of a soft start increases
LATCHED = frozenset({StopReason.PERSON_CHANGED, StopReason.LAGS})
"""After these faults the dead-man input must be released before the robot starts again."""


@dataclass(frozen=True, kw_only=True)
class Situation:
    """Input of the state machine at one instant."""

    now_ns: int  # [ns] monotonic clock
    fault: StopReason | None
    is_held: bool
    is_at_rest: bool  # whether the command is at rest
    distance: Callable[[], float]  # [rad] largest difference of a joint to the person's pose


class Supervisor:
    """The state machine.

    Attributes:
        state: State of the robot.
        fault: The last fault, or the one that prevents a start; None while the robot follows.

    Args:
        parameters: Times, velocity and tolerance of the start; kind of the dead-man input.
        full_velocity: Velocity limit of the fastest joint [rad/s].
    """

    def __init__(self, parameters: ArmParameters, full_velocity: float) -> None:
        self.state = State.WAITING
        self.fault: StopReason | None = StopReason.NOT_HELD
        self._parameters, self._full_velocity = parameters, full_velocity
        self._settle_ns = round(parameters.settle_time * NS_PER_S)
        self._ramp_ns = round(parameters.ramp_time * NS_PER_S)
        self._is_latched = False
        self._well_since_ns: int | None = None
        self._moving_since_ns = 0  # in this state
        self._begun_at = parameters.soft_velocity  # velocity limit at the start of FOLLOWING
        self._now_ns = 0

    @property
    def fastest(self) -> float:
        """Current velocity limit of every joint [rad/s].

        It increases in a soft start that has not reached a moving person.
        """
        since_ns = self._now_ns - self._moving_since_ns
        if self.state is State.FOLLOWING:
            share = min(1.0, since_ns / max(self._ramp_ns, 1))
            return self._begun_at + (self._full_velocity - self._begun_at) * share
        late_s = max(0.0, since_ns / NS_PER_S - SOFT_S)
        return min(self._parameters.soft_velocity * (1.0 + late_s), self._full_velocity)

    def update(self, situation: Situation) -> State:
        """Update the state machine; returns the new state."""
        self._now_ns = situation.now_ns
        fault = situation.fault
        if fault is None and not situation.is_held:
            fault = StopReason.NOT_HELD
        self._latch(fault, situation.is_held)
        is_well = fault is None and not self._is_latched
        if not is_well:
            self._well_since_ns = None
            self.fault = fault or self.fault
        elif self._well_since_ns is None:
            self._well_since_ns = situation.now_ns
        moves = self.state in (State.SOFT_START, State.FOLLOWING)
        near = self._parameters.soft_tolerance
        if moves and not is_well:
            self.state = State.SLOWING
        elif self.state is State.SLOWING and situation.is_at_rest:
            self.state = State.FROZEN
        elif self.state in (State.FROZEN, State.WAITING):
            self._wait(is_well)
        elif self.state is State.SOFT_START and situation.distance() < near:
            self._begun_at = self.fastest
            self.state, self._moving_since_ns = State.FOLLOWING, situation.now_ns
        return self.state

    def _latch(self, fault: StopReason | None, is_held: bool) -> None:
        can_be_released = self._parameters.dead_man != "none"
        if fault in LATCHED and can_be_released and self.state is not State.WAITING:
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
