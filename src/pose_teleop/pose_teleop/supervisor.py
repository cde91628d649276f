"""State machine that starts and stops the robot; every start is a soft start.

::

    WAITING ── well and held for settle_time ──► SOFT_START ── at the person's pose ──► FOLLOWING
       ▲                                             │                                     │
       └── well again ── FROZEN ◄── at rest ── SLOWING ◄──────── anything is wrong ────────┘
"""

from collections.abc import Callable
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


class ArmFault(Enum):
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


TO_PERSON = (State.SOFT_START, State.FOLLOWING)
"""States in which the robot moves to the person's pose."""
SOFT_S = 3.0  # [s] after which the velocity of a soft start increases
LATCHED = frozenset({ArmFault.PERSON_CHANGED, ArmFault.LAGS})
"""After these faults the dead-man input must be released before the robot starts again."""


class Supervisor:
    """The state machine.

    Attributes:
        state: State of the robot.
        fault: The last fault, or the one that prevents a start; None while the robot follows.
        latched: The fault after which the dead-man input has to be released; None without one.

    Args:
        parameters: Times, velocity and tolerance of the start; kind of the dead-man input.
        full_velocity: Velocity limit of the fastest joint [rad/s].
    """

    def __init__(self, parameters: ArmParameters, full_velocity: float) -> None:
        self.state = State.WAITING
        self.fault: ArmFault | None = ArmFault.NOT_HELD
        self._parameters, self._full_velocity = parameters, full_velocity
        self._settle_ns = round(parameters.settle_time * NS_PER_S)
        self._ramp_ns = round(parameters.ramp_time * NS_PER_S)
        self.latched: ArmFault | None = None
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

    def update(
        self,
        *,
        now_ns: int,
        fault: ArmFault | None,
        is_held: bool,
        is_at_rest: bool,
        distance: Callable[[], float],
    ) -> State:
        """Update the state machine; returns the new state.

        Args:
            now_ns: Monotonic clock [ns].
            fault: The current fault.
            is_held: Whether the dead-man input is held.
            is_at_rest: Whether the command is at rest.
            distance: Largest difference of a joint to the person's pose [rad].
        """
        self._now_ns = now_ns
        if fault is None and not is_held:
            fault = ArmFault.NOT_HELD
        self._latch(fault, is_held)
        is_well = fault is None and self.latched is None
        if not is_well:
            self._well_since_ns = None
            self.fault = self.latched or fault or self.fault
        elif self._well_since_ns is None:
            self._well_since_ns = now_ns
        near = self._parameters.soft_tolerance
        if self.state in TO_PERSON and not is_well:
            self.state = State.SLOWING
        elif self.state is State.SLOWING and is_at_rest:
            self.state = State.FROZEN
        elif self.state in (State.FROZEN, State.WAITING):
            self._wait(is_well)
        elif self.state is State.SOFT_START and distance() < near:
            self._begun_at = self.fastest
            self.state, self._moving_since_ns = State.FOLLOWING, now_ns
        return self.state

    def _latch(self, fault: ArmFault | None, is_held: bool) -> None:
        can_be_released = self._parameters.dead_man != "none"
        if fault in LATCHED and can_be_released and self.state is not State.WAITING:
            self.latched = fault
        elif not is_held:
            self.latched = None

    def _wait(self, is_well: bool) -> None:
        if not is_well:
            return
        assert self._well_since_ns is not None
        if self.state is State.FROZEN:
            self.state = State.WAITING
        elif self._now_ns - self._well_since_ns >= self._settle_ns:
            self.state, self.fault = State.SOFT_START, None
            self._moving_since_ns = self._now_ns
