"""Online trajectory generation: the command stays within all limits for any target.

Between two commands each joint moves along the time-optimal, jerk-limited trajectory to its target
(Berscheid and Kröger, *Jerk-limited real-time trajectory generation with arbitrary target states*,
RSS 2021; the library `ruckig`). A step is taken only if the joint could still brake before its
limits of position after it; otherwise it brakes. So, from a start at rest within the limits, every
command and every stopping trajectory is within them.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from pose_core.api import FloatArray
from pose_core.counters import Counters
from pose_teleop.extras import require

JERK_OF_ACCELERATION = 25.0  # [1/s] default ratio of jerk limit to acceleration limit
INSIDE = 1e-6  # [rad] smallest distance of targets from the limits of position
SPEED_OF_TARGET = 0.95  # [-] largest velocity of a target, relative to the velocity limit


@dataclass(frozen=True, kw_only=True)
class MotionLimits:
    """Motion limits of n joints."""

    lower: FloatArray  # [rad] (n,)
    upper: FloatArray  # [rad]
    velocity: FloatArray  # [rad/s]
    acceleration: FloatArray  # [rad/s2]
    jerk: FloatArray  # [rad/s3]


@dataclass(frozen=True, kw_only=True)
class MotionState:
    """Position, velocity and acceleration of n joints."""

    position: FloatArray  # [rad] (n,)
    velocity: FloatArray  # [rad/s]
    acceleration: FloatArray  # [rad/s2]

    @property
    def is_at_rest(self) -> bool:
        """Whether all joints are at rest."""
        return bool(np.abs(self.velocity).max() < 1e-6 and np.abs(self.acceleration).max() < 1e-4)


class MotionLimiter:
    """Moves n joints to a target within limits."""

    def __init__(self, limits: MotionLimits) -> None:
        ruckig = require("ruckig")
        self.limits = limits
        self.counters = Counters("targets_not_finite", "plans_failed", "braked_for_position")
        count = len(limits.lower)
        self._good = (ruckig.Result.Working, ruckig.Result.Finished)
        self._planner = ruckig.Ruckig(count)
        self._plan, self._stop = ruckig.Trajectory(count), ruckig.Trajectory(count)
        self._to_target = self._input(ruckig, count)
        self._to_stop = self._input(ruckig, count)
        self._to_stop.control_interface = ruckig.ControlInterface.Velocity
        self._to_stop.target_velocity = [0.0] * count
        self.reset(np.zeros(count))

    def reset(self, position: FloatArray) -> None:
        """Start at rest at a position [rad], (n,), clipped to the limits."""
        inside = np.clip(position, self.limits.lower, self.limits.upper)
        zero = np.zeros(len(inside))
        self.motion = MotionState(position=inside, velocity=zero, acceleration=zero)

    def follow(
        self, target: FloatArray, rate: FloatArray, period_s: float, fastest: float = np.inf
    ) -> MotionState:
        """Move towards a target for one period.

        Args:
            target: Target position [rad], (n,).
            rate: The target's velocity [rad/s], (n,).
            period_s: Time until the next command [s].
            fastest: Velocity limit of every joint during the period [rad/s].

        Returns:
            The motion after the period.
        """
        if not (np.isfinite(target).all() and np.isfinite(rate).all()):
            self.counters.add("targets_not_finite")
            return self.brake(period_s)
        limits, given = self.limits, self._to_target
        inside = np.clip(target, limits.lower + INSIDE, limits.upper - INSIDE)
        top = np.minimum(limits.velocity, fastest)
        given.max_velocity = top.tolist()
        given.target_position = inside.tolist()
        wanted = np.clip(rate, -SPEED_OF_TARGET * top, SPEED_OF_TARGET * top)
        given.target_velocity = np.where(inside == target, wanted, 0.0).tolist()
        self._start_at(given, self.motion)
        if self._planner.calculate(given, self._plan) not in self._good:
            self.counters.add("plans_failed")
            return self.brake(period_s)
        self.motion = self._safe(_at(self._plan, period_s), period_s)
        return self.motion

    def brake(self, period_s: float) -> MotionState:
        """Brake for one period; returns the motion after it."""
        self._plan_stop(self.motion)
        self.motion = _at(self._stop, period_s)
        return self.motion

    def way_to_stop(self, period_s: float) -> list[MotionState]:
        """The motions at every period until all joints are at rest."""
        self._plan_stop(self.motion)
        count = int(np.ceil(self._stop.duration / period_s - 1e-9))
        return [_at(self._stop, (i + 1) * period_s) for i in range(count)]

    def _safe(self, next_motion: MotionState, period_s: float) -> MotionState:
        """Replace the motion of joints that could not stop within their limits by braking."""
        self._plan_stop(next_motion)
        end = _at(self._stop, self._stop.duration).position
        ways = np.stack([next_motion.position, end, _turning_point(next_motion, self.limits.jerk)])
        bad = (ways.min(axis=0) < self.limits.lower) | (ways.max(axis=0) > self.limits.upper)
        if not bad.any():
            return next_motion
        self.counters.add("braked_for_position", int(bad.sum()))
        self._plan_stop(self.motion)
        braking = _at(self._stop, period_s)
        return MotionState(
            position=np.where(bad, braking.position, next_motion.position),
            velocity=np.where(bad, braking.velocity, next_motion.velocity),
            acceleration=np.where(bad, braking.acceleration, next_motion.acceleration),
        )

    def _plan_stop(self, motion: MotionState) -> None:
        self._start_at(self._to_stop, motion)
        self._planner.calculate(self._to_stop, self._stop)

    def _input(self, ruckig: Any, count: int) -> Any:
        given = ruckig.InputParameter(count)
        given.synchronization = ruckig.Synchronization.No
        given.max_velocity = self.limits.velocity.tolist()
        given.max_acceleration = self.limits.acceleration.tolist()
        given.max_jerk = self.limits.jerk.tolist()
        given.target_acceleration = [0.0] * count
        return given

    @staticmethod
    def _start_at(given: Any, motion: MotionState) -> None:
        given.current_position = motion.position.tolist()
        given.current_velocity = motion.velocity.tolist()
        given.current_acceleration = motion.acceleration.tolist()


def _turning_point(motion: MotionState, jerk: FloatArray) -> FloatArray:
    """Positions where joints reverse while they stop [rad], (n,); the current ones otherwise.

    A joint that brakes harder than its velocity requires passes zero velocity: with the largest
    jerk against its acceleration, at the smaller root of v + a t + j t²/2 = 0.
    """
    sign = np.where(motion.velocity >= 0.0, 1.0, -1.0)
    v, a = sign * motion.velocity, sign * motion.acceleration
    root = a * a - 2.0 * jerk * v
    turns = (a < 0.0) & (root > 0.0)
    t = np.where(turns, (-a - np.sqrt(np.maximum(root, 0.0))) / jerk, 0.0)
    return motion.position + sign * t * (v + t * (a / 2.0 + t * jerk / 6.0))


def _at(trajectory: Any, time_s: float) -> MotionState:
    position, velocity, acceleration = map(np.array, trajectory.at_time(time_s))
    return MotionState(position=position, velocity=velocity, acceleration=acceleration)
