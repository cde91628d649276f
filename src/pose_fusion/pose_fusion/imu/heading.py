r"""Which way an IMU's world turns against map, followed while it drifts.

Without a magnetometer an IMU's world starts anywhere and turns slowly about the vertical, by what
is left of the gyroscope's bias. A Kalman filter follows the turn :math:`y` from the IMU's world to
map now, its drift :math:`\dot y`, the turn :math:`y_0` at the neutral pose, on which the mounting
rests, and how far beside their place the cameras see lateral axes. :math:`y_0` is measured through
its correlation with :math:`y` alone (a fixed-point smoother), so the mounting becomes better while
the drift is followed, and neither disturbs the other.

Measured is the angle about the vertical between where the IMU and where the cameras see one axis
point. An axis that leans by :math:`l = \sin(\text{tilt})` shows it with the standard deviation
:math:`\sigma / l`. Innovations are limited (Huber), so that a wrongly tracked joint does little. A
quick closed-form estimate over the last seconds runs beside it: it gives the first value, and
where both differ clearly for long, as after a device has begun anew, it replaces the slow one.
"""

import math

import numpy as np

from pose_fusion.streams.samples import FloatArray

AXIS_STDDEV = 0.07  # [rad] of a direction that the cameras see, most of it slow
CORRELATION_S = 0.5  # [s] over which errors of that direction stay alike
LONGEST_STEP_S = 0.1  # [s] that one instant may count for
LEAST_LEAN = 0.17  # [-] horizontal part of an axis, ten degrees, below which it shows no heading
LIMIT = 2.0  # [-] standard deviations of an innovation beyond which it counts no more
HEADING_WALK = math.radians(0.3) ** 2 / 60.0  # [rad²/s] random part of the drift
DRIFT_STDDEV = math.radians(1.0) / 60.0  # [rad/s] of the drift, before anything is known of it
DRIFT_WALK = (math.radians(1.0) / 60.0) ** 2 / 600.0  # [(rad/s)²/s] how fast that may change
LATERAL_STDDEV = math.radians(15.0)  # [rad] of shoulders' and hips' lines, and of hinges
LEAN_BIAS_STDDEV = math.radians(6.0)  # [rad] of headings by leaning limbs, that lasts
FIRST_LEAN_S = 0.1  # [s] of an axis fully horizontal, after which there is a first value
RECENT_S = 5.0  # [s] of observation that the quick estimate remembers
RECENT_LEAST_S = 1.0  # [s] of an axis fully horizontal, before it may contradict
CONTRADICTION = math.radians(30.0)  # [rad] between quick and slow estimate
CONTRADICTED_S = 3.0  # [s] of observation that they must differ for
RESTART_STDDEV = math.radians(20.0)  # [rad] of the quick estimate: some of it is from before
SETTLED = math.radians(5.0)  # [rad] stddev of y₀ below which a contradiction leaves it alone

Y = np.array([1.0, 0.0, 0.0, 0.0])  # what a leaning axis measures
TURNED = np.array([1.0, 0.0, -1.0, 1.0])  # what a lateral axis measures
LEANING = np.array([1.0, 0.0, 1.0, 0.0])  # the same two where the mounting is known
BESIDE = np.array([1.0, 0.0, 0.0, 1.0])
STANDING = np.array([1.0, 0.0, 0.0, 0.0])  # and what a neutral stand measures then


class HeadingAnchor:
    """Heading of one IMU's world, its drift, and the heading at the neutral pose.

    Args:
        is_mounting_known: Whether the mounting rests on a calibration: then no heading at a neutral
            pose is sought, it is zero.
    """

    def __init__(self, *, is_mounting_known: bool = False) -> None:
        self._is_mounting_known = is_mounting_known
        self._state: FloatArray | None = None  # y, drift [rad/s], y₀, lateral error [rad]
        self._covariance = np.zeros((4, 4))
        self._dot = self._cross = 0.0  # [s] recent sums of a leaning axis' products
        self._contradicted_s = 0.0
        self._neutral: tuple[float, float] | None = None  # y₀ and its variance, kept over a loss
        self.restarts = 0

    @property
    def heading(self) -> float | None:
        """Turn [rad] about the vertical from the IMU's world to map; None if not yet observed."""
        return None if self._state is None else float(self._state[0])

    @property
    def neutral_heading(self) -> float | None:
        """The same turn [rad] at the neutral pose; 0 where the mounting is known otherwise."""
        if self._is_mounting_known:
            return 0.0  # the mounting rests on no neutral pose
        return None if self._state is None else float(self._state[2])

    @property
    def stddev(self) -> float:
        """Standard deviation [rad] of :attr:`heading`; π if not yet observed."""
        return math.pi if self._state is None else math.sqrt(float(self._covariance[0, 0]))

    @property
    def recent(self) -> tuple[float, float]:
        """Recent sums of dot and cross products of the axis seen by IMU and cameras [s]."""
        return self._dot, self._cross

    def start(self, heading: float, stddev: float) -> None:
        """Begin with a heading [rad] and its standard deviation [rad]."""
        self._state = np.array([heading, 0.0, heading, 0.0])
        self._covariance = np.diag([stddev**2, DRIFT_STDDEV**2, stddev**2, LATERAL_STDDEV**2])
        self._covariance[0, 2] = self._covariance[2, 0] = stddev**2
        if self._is_mounting_known:
            self._begin_with_bias(stddev)
        elif self._neutral is not None:
            self._keep_neutral(*self._neutral)
        self._contradicted_s = 0.0

    def _keep_neutral(self, heading: float, variance: float) -> None:
        """The mounting has been known before: it is the IMU's world that has turned."""
        if self._state is None:
            return
        self._state[2] = heading
        self._covariance[0, 2] = self._covariance[2, 0] = 0.0
        self._covariance[2, 2] = variance

    def _begin_with_bias(self, stddev: float) -> None:
        """Where the mounting is known, y₀ makes room for what the cameras lastingly see beside."""
        if self._state is None:
            return
        self._state[2] = 0.0
        bias = LEAN_BIAS_STDDEV**2
        self._covariance[0, 0] = stddev**2 + bias
        self._covariance[2, 2] = bias
        self._covariance[0, 2] = self._covariance[2, 0] = -bias  # only their sum has been seen

    def observe_standing(self, heading: float, stddev: float) -> None:
        """Take the heading [rad] that a neutral stand tells, where the mounting is known."""
        if self._state is None:
            self.start(heading, stddev)
            self._covariance[0, 0], self._covariance[0, 2] = stddev**2, 0.0
            self._covariance[2, 0] = 0.0
            return
        self._update(_wrapped(heading - float(self._state[0])), STANDING, stddev**2)

    def predict(self, dt_s: float) -> None:
        """Let the heading drift on for ``dt_s`` [s]."""
        if self._state is None or dt_s <= 0.0:
            return
        P = self._covariance
        self._state[0] += dt_s * self._state[1]
        P[0] += dt_s * P[1]
        P[:, 0] += dt_s * P[:, 1]
        P[0, 0] += dt_s * HEADING_WALK
        P[1, 1] += dt_s * DRIFT_WALK

    def lose_heading(self) -> None:
        """The IMU's world may have turned to anywhere; the neutral pose's heading stays known."""
        if self._state is None:
            return
        self._neutral = (float(self._state[2]), float(self._covariance[2, 2]))
        self._state = None
        self._dot = self._cross = 0.0

    def observe_lean(self, dt_s: float, axis_world: FloatArray, axis_map: FloatArray) -> None:
        """Compare where IMU and cameras see an axis that the neutral pose made known.

        Args:
            dt_s: Time [s] that this instant stands for.
            axis_world: The axis in the IMU's world, shape (3,).
            axis_map: The axis in map as the cameras see it, shape (3,).
        """
        dot, cross, lean = _compare(axis_world, axis_map)
        if not lean > LEAST_LEAN:  # false of NaN
            return
        dt_s = min(dt_s, LONGEST_STEP_S)
        keep = math.exp(-dt_s / RECENT_S)
        self._dot = keep * self._dot + dt_s * dot
        self._cross = keep * self._cross + dt_s * cross
        if self._state is None:
            strength = math.hypot(self._dot, self._cross)
            if strength > FIRST_LEAN_S:
                stddev = AXIS_STDDEV * math.sqrt(CORRELATION_S / strength)
                self.start(math.atan2(self._cross, self._dot), stddev)
            return
        self._correct(dt_s, math.atan2(cross, dot), lean, Y)
        self._watch(dt_s)

    def observe_turned(
        self, dt_s: float, axis_world: FloatArray, axis_map: FloatArray, sharpness: float
    ) -> None:
        """Compare an axis whose place in the sensor rests on :attr:`neutral_heading`.

        Such an axis, the trunk's lateral one or a bent knee's hinge, shows how far the world has
        turned since then.

        Args:
            dt_s: Time [s] that this instant stands for.
            axis_world: The axis in the IMU's world, shape (3,).
            axis_map: The axis in map as the cameras see it, shape (3,).
            sharpness: How well they see it [-]: 1 like a long axis, less in proportion.
        """
        dot, cross, lean = _compare(axis_world, axis_map)
        lean *= sharpness
        if not lean > LEAST_LEAN:  # false of NaN
            return
        if self._state is None and self._is_mounting_known:
            # Before any lean: as good as the cameras see this line beside its place.
            self.start(math.atan2(cross, dot), math.hypot(LATERAL_STDDEV, AXIS_STDDEV / lean))
            self._covariance[0, 0] = LATERAL_STDDEV**2 + (AXIS_STDDEV / lean) ** 2
            self._covariance[0, 2] = self._covariance[2, 0] = 0.0
            self._covariance[0, 3] = self._covariance[3, 0] = -(LATERAL_STDDEV**2)
        elif self._state is not None:
            self._correct(min(dt_s, LONGEST_STEP_S), math.atan2(cross, dot), lean, TURNED)

    def _correct(self, dt_s: float, angle: float, lean: float, H: FloatArray) -> None:
        if self._state is None or dt_s <= 0.0:
            return
        is_lateral = H is TURNED
        if self._is_mounting_known:
            H = BESIDE if is_lateral else LEANING
        noise = (AXIS_STDDEV / lean) ** 2 * CORRELATION_S / dt_s
        # y₀ has been taken up already where the axis was brought into the world.
        expected = float(self._state[0]) + (float(self._state[3]) if is_lateral else 0.0)
        if H is LEANING:
            expected += float(self._state[2])
        # The angle itself errs by σ/l, however short the instant: that is where it is limited.
        limit = LIMIT * math.sqrt(float(H @ self._covariance @ H) + (AXIS_STDDEV / lean) ** 2)
        innovation = _wrapped(angle - expected)
        self._update(min(max(innovation, -limit), limit), H, noise)

    def _update(self, innovation: float, H: FloatArray, noise: float) -> None:
        if self._state is None:
            return
        PH = self._covariance @ H
        variance = float(H @ PH) + noise
        self._state = self._state + PH * (innovation / variance)
        self._covariance -= np.outer(PH, PH) / variance

    def _watch(self, dt_s: float) -> None:
        """Begin anew from the last seconds where they contradict all that was before."""
        if self._state is None:
            return
        recent = math.atan2(self._cross, self._dot)
        is_other = abs(_wrapped(recent - float(self._state[0]))) > CONTRADICTION
        if not is_other or math.hypot(self._dot, self._cross) < RECENT_LEAST_S:
            self._contradicted_s = 0.0
            return
        self._contradicted_s += dt_s
        if self._contradicted_s < CONTRADICTED_S:
            return
        neutral, P = float(self._state[2]), float(self._covariance[2, 2])
        self.start(recent, RESTART_STDDEV)
        self.restarts += 1
        if self._is_mounting_known:
            return
        if P < SETTLED**2:
            self._keep_neutral(neutral, P)


def _compare(axis_world: FloatArray, axis_map: FloatArray) -> tuple[float, float, float]:
    """Dot and cross product of the horizontal parts, and how far they lean [-] together."""
    (a, b, _), (c, d, _) = axis_world.tolist(), axis_map.tolist()
    dot, cross = a * c + b * d, a * d - b * c
    return dot, cross, math.sqrt(math.hypot(dot, cross))


def _wrapped(angle: float) -> float:
    return math.remainder(angle, 2.0 * math.pi)
