"""Joint angles over time, composed of minimum-jerk moves.

A move changes an angle by Δ within T: ``Δ (10 s³ − 15 s⁴ + 6 s⁵)``, s = t / T (Flash and Hogan,
1985, J. Neuroscience 5(7)): velocity and acceleration are zero at both ends. An angle is the sum
of its moves, so that moves may overlap and the sum stays twice continuously differentiable.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from pose_core.arrays import FloatArray
from pose_sim.body import BODY_ANGLES, Body
from pose_sim.sizes import size

Profile = Callable[[FloatArray], FloatArray]
EXTRA_CHANNELS = ("clearance",)  # [m] of the lower foot above the floor, in a jump
MAX_DEGREES = {"shoulder_flexion": 176.0, "shoulder_abduction": 87.0, "knee_flexion": 140.0}
"""Largest angles with variation [deg]."""


@dataclass(frozen=True, kw_only=True)
class Variation:
    """Natural variation of movements and between persons; standard deviations."""

    amplitude: float = size(0.08, "-", 0.5, "variation of each movement's amplitude, relative")
    tempo: float = size(0.06, "-", 0.3, "variation of each movement's duration, relative")
    person_tempo: float = size(0.08, "-", 0.5, "largest variation of the person's overall speed")
    asymmetry: float = size(0.04, "-", 0.5, "largest asymmetry of left and right movements")
    sway: float = size(0.6, "deg", 10.0, "postural sway of trunk, head and arms")


LEAN = float(np.radians(3.4))  # [rad] by which the centre of mass is in front of the ankles


class AngleTimeline:
    """Joint angles of a choreography; each move advances its time.

    Args:
        body: The body, which determines the height of jumps.
        rng: Random generator of the natural variation.
        variation: Size of the natural variation.
    """

    def __init__(
        self, body: Body, rng: np.random.Generator, variation: Variation | None = None
    ) -> None:
        self.body = body
        self.now = 0.0  # [s] start of the next move
        self.lean = LEAN  # [rad] of the whole body; jumps and steps are computed without
        self._rng = rng
        self.variation = variation or Variation()
        self._tempo = 1.0 + self.variation.person_tempo * rng.uniform(-1.0, 1.0)
        asymmetry = self.variation.asymmetry * rng.uniform(-1.0, 1.0)
        self._side_gain = {"left": 1.0 + asymmetry, "right": 1.0 - asymmetry}
        channels = (*BODY_ANGLES, *EXTRA_CHANNELS)
        self._targets = dict.fromkeys(channels, 0.0)
        self._moves: dict[str, list[tuple[float, float, float]]] = {c: [] for c in channels}
        self._profiles: dict[str, list[tuple[float, float, Profile]]] = {c: [] for c in channels}

    def target(self, angle: str) -> float:
        """Value of an angle after all moves so far [deg]."""
        return float(np.degrees(self._targets[angle]))

    def wait(self, duration: float) -> None:
        """Advance the time by ``duration`` [s]."""
        self.now += duration

    def move(
        self,
        duration: float,
        targets: Mapping[str, float],
        *,
        exact: bool = False,
        advance: float | None = None,
    ) -> None:
        """Move angles to new values, with natural variation.

        Args:
            duration: Planned duration [s].
            targets: Angles [deg] by their names in :data:`pose_sim.body.BODY_ANGLES`.
            exact: Without variation of the sizes and the duration, except for the person's speed.
            advance: Time by which the timeline is advanced [s]; the move's duration if None.
        """
        spread = 0.0 if exact else self.variation.tempo
        actual = duration * self._tempo * (1.0 + spread * self.vary())
        for name, degrees in targets.items():
            side, _, angle = name.partition("_")
            gain = 1.0
            if not exact:
                gain += self.variation.amplitude * self.vary()
                gain *= self._side_gain.get(side, 1.0)
            goal = float(np.radians(min(degrees * gain, MAX_DEGREES.get(angle, np.inf))))
            self._moves[name].append((self.now, actual, goal - self._targets[name]))
            self._targets[name] = goal
        self.now += actual if advance is None else advance * self._tempo

    def add_profile(self, channel: str, duration: float, profile: Profile) -> None:
        """Add a function of the time since now [s]; outside [0, duration] it has its end values.

        Its value, velocity and acceleration must be zero at the start, its velocity and
        acceleration at the end. The timeline's time is not advanced.
        """
        self._profiles[channel].append((self.now, duration, profile))
        self._targets[channel] += float(profile(np.array([duration]))[0])

    def evaluate(self, times: FloatArray) -> dict[str, FloatArray]:
        """All channels [rad] (clearance [m]) at increasing times [s], shape (n,) each."""
        return {channel: self._evaluate(channel, times) for channel in self._moves}

    def _evaluate(self, channel: str, times: FloatArray) -> FloatArray:
        values = np.zeros_like(times)
        for start, duration, delta in self._moves[channel]:
            first, last = np.searchsorted(times, (start, start + duration))
            values[first:last] += delta * minimum_jerk((times[first:last] - start) / duration)
            values[last:] += delta
        for start, duration, profile in self._profiles[channel]:
            first, last = np.searchsorted(times, (start, start + duration))
            values[first:last] += profile(times[first:last] - start)
            values[last:] += profile(np.array([duration]))
        return values

    def vary(self) -> float:
        """Draw a normal variate, limited to two standard deviations."""
        return float(np.clip(self._rng.standard_normal(), -2.0, 2.0))


def minimum_jerk(phase: FloatArray) -> FloatArray:
    """Minimum-jerk transition from 0 to 1 over phase 0 to 1, constant outside."""
    s = np.clip(phase, 0.0, 1.0)
    return s**3 * (10.0 + s * (6.0 * s - 15.0))
