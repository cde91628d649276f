"""A jump on the spot: crouch, push-off, flight, landing.

In flight only gravity moves the hips: their height is ``z(t) = z₀ + v₀ t − g t²/2``. The legs'
angles follow from the height of the hips above the floor (in contact) or the feet (in flight).
"""

import numpy as np
from scipy.interpolate import BPoly, CubicSpline

from imu_bridge.protocols.reading import STANDARD_GRAVITY
from pose_core.arrays import FloatArray
from pose_sim.body import ANKLE_HEIGHT, FOOT, SHANK, THIGH, Body, neutral_angles
from pose_sim.moves import both
from pose_sim.timeline import AngleTimeline, Profile, minimum_jerk

CROUCH = 75.0  # [deg] bend of the legs at the start of the push-off
ABSORB = 65.0  # [deg] bend at the end of the landing
TAKE_OFF = 12.0  # [deg] bend at take-off and touch-down
TIPTOE = -42.0  # [deg] straight, on tiptoe
HEEL_RISE = 55.0  # [deg] rise of the heel at a bend of -60 deg
PUSH_TIME, ABSORB_TIME = 0.30, 0.32  # [s]


def jump(t: AngleTimeline) -> None:
    """Add one jump to the timeline."""
    t.lean = 0.0
    crouched = both(**leg_pose(np.array([CROUCH])))
    down = {name: float(np.degrees(values[0])) for name, values in crouched.items()}
    arms_back, arms_up = both(shoulder_flexion=-30.0), both(shoulder_flexion=75.0)
    t.move(0.75, down, exact=True, advance=0.0)
    t.move(0.75, arms_back, advance=0.0)
    tilt(t, 0.75, 24.0)
    t.wait(0.2)
    flight = _Flight(t.body, rise=0.095 + 0.02 * np.tanh(t.vary()))
    for name, values in crouched.items():
        t.add_profile(name, flight.duration, flight.leg_profile(name, float(values[0])))
    t.add_profile("clearance", flight.duration, flight.clearance)
    landed = t.now + flight.duration
    t.move(0.5, arms_up, advance=0.0)
    tilt(t, 0.45, 8.0)
    tilt(t, 0.45, 20.0)
    t.now = max(t.now, landed)
    t.move(0.8, dict.fromkeys(down, 0.0), exact=True, advance=0.0)
    t.move(0.8, dict.fromkeys(("pelvis_tilt", *arms_up), 0.0), exact=True)
    t.wait(0.2)


def tilt(t: AngleTimeline, duration: float, angle: float) -> None:
    """Tilt the pelvis forward to ``angle`` [deg]; the hips compensate, so that the legs stay."""
    change = angle - t.target("pelvis_tilt")
    hips = {name: t.target(name) + change for name in ("left_hip_flexion", "right_hip_flexion")}
    t.move(duration, {"pelvis_tilt": angle, **hips}, exact=True)


def leg_pose(bend: FloatArray) -> dict[str, FloatArray]:
    """Leg angles [rad] below an upright pelvis, from bent to tiptoe (negative ``bend`` [deg])."""
    knee = np.radians(0.5 * (bend + np.sqrt(bend**2 + 18.0**2)))
    rise = np.radians(HEEL_RISE) * minimum_jerk((40.0 - bend) / 100.0)
    # The hips stay above one point of the floor: thighs and shanks lean forward by the way that
    # the balls of the feet move back as the heels rise.
    ball = 0.48 * FOOT
    back = ball - (ball * np.cos(rise) - ANKLE_HEIGHT * np.sin(rise))
    thigh = 0.5 * knee + np.arcsin(back / ((THIGH + SHANK) * np.cos(0.5 * knee)))
    return {"hip_flexion": thigh, "knee_flexion": knee, "ankle_flexion": -rise}


class _Flight:
    """Heights during a jump, as functions of the time [s] since the start of the push-off."""

    def __init__(self, body: Body, rise: float) -> None:
        bends = np.linspace(CROUCH + 10.0, TIPTOE, 150)
        angles = neutral_angles(len(bends))
        angles.update(both(**leg_pose(bends)))
        lowest, _ = body.contact_height(body.pose(angles).contacts)
        reach = -lowest  # [m] height of the hips above the lowest point of the feet
        self._bend = CubicSpline(reach, bends)
        height = CubicSpline(-bends, reach)
        take_off = float(height(-TAKE_OFF))
        speed = np.sqrt(2.0 * STANDARD_GRAVITY * rise)
        self._air = 2.0 * speed / STANDARD_GRAVITY  # [s]
        self._tuck = 1.3 * rise  # [m] height of the feet above the floor, at most
        # Quintics between two states: height, velocity, acceleration.
        crouching, leaving = (height(-CROUCH), 0.0, 0.0), (take_off, speed, -STANDARD_GRAVITY)
        landing, absorbed = (take_off, -speed, -STANDARD_GRAVITY), (height(-ABSORB), 0.0, 0.0)
        self._push = BPoly.from_derivatives([0.0, PUSH_TIME], [crouching, leaving])
        self._absorb = BPoly.from_derivatives([0.0, ABSORB_TIME], [landing, absorbed])
        self._ballistic = np.polynomial.Polynomial([take_off, speed, -0.5 * STANDARD_GRAVITY])
        self.duration = PUSH_TIME + self._air + ABSORB_TIME

    def clearance(self, t: FloatArray) -> FloatArray:
        """Height of the feet above the floor [m], with continuous velocity."""
        s = np.clip((t - PUSH_TIME) / self._air, 0.0, 1.0)
        return self._tuck * (4.0 * s * (1.0 - s)) ** 3

    def bend(self, t: FloatArray) -> FloatArray:
        """Bend of the legs [deg]."""
        air, ground = t - PUSH_TIME, t - PUSH_TIME - self._air
        hips = np.where(air < 0.0, self._push(t), self._ballistic(air))
        hips = np.where(ground >= 0.0, self._absorb(ground), hips)
        return self._bend(hips - self.clearance(t))

    def leg_profile(self, name: str, start: float) -> Profile:
        """Change of one leg angle [rad] from its value at the start of the push-off."""
        return lambda t: both(**leg_pose(self.bend(t)))[name] - start
