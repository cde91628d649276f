"""Headings of IMUs' worlds: the arithmetic of :mod:`pose_core.imu.heading`, a row an IMU."""

import numpy as np

from pose_core.kernels.anchors import (
    BESIDE,
    DRIFT,
    LATERAL,
    STATES,
    Y0,
    Anchors,
    Y,
    forget_covariance,
    is_known,
    own_covariance,
)
from pose_core.kernels.compiling import compiled, compiled_in_place
from pose_core.kernels.fresh_part import take_fresh_part
from pose_core.streams.samples import FloatArray

AXIS_STDDEV = 0.07  # [rad] of a direction that the cameras see, most of it slow
CORRELATION_S = 0.5  # [s] over which errors of that direction stay alike
FRESH_STDDEV = 0.03  # [rad] of the fresh part of a direction, where a limb is at rest,
TURNING_STDDEV = 0.02  # [s] and where it turns, in proportion to its rate,
FASTEST = 2.0  # [rad/s] up to this
FRESH_CORRELATION_S = 0.2  # [s] over which errors of the fresh part stay alike
LEAST_FRESH = 0.05  # [-] horizontal part of it: an axis at rest that leans by ten degrees has that
LONGEST_STEP_S = 0.1  # [s] that one instant may count for
LEAST_LEAN = 0.17  # [-] horizontal part of an axis, ten degrees, below which it shows no heading
LIMIT = 1.5  # [-] standard deviations of an innovation beyond which it counts no more
HEADING_WALK = np.radians(0.3) ** 2 / 60.0  # [rad²/s] random part of the drift
DRIFT_STDDEV = np.radians(1.0) / 60.0  # [rad/s] of the drift, before anything is known of it
DRIFT_WALK = (np.radians(1.0) / 60.0) ** 2 / 300.0  # [(rad/s)²/s] a bias that walks by 0.001 °/s/√s
LATERAL_STDDEV = np.radians(15.0)  # [rad] of shoulders' and hips' lines, and of hinges
LEAN_BIAS_STDDEV = np.radians(6.0)  # [rad] of headings by leaning limbs, that lasts
FIRST_LEAN_S = 0.1  # [s] of an axis fully horizontal, after which there is a first value
RECENT_S = 5.0  # [s] of observation that the quick estimate remembers
RECENT_LEAST_S = 1.0  # [s] of an axis fully horizontal, before it may contradict
CONTRADICTION = np.radians(30.0)  # [rad] between quick and slow estimate
CONTRADICTED_S = 3.0  # [s] of observation that they must differ for
RESTART_STDDEV = np.radians(20.0)  # [rad] of the quick estimate: some of it is from before
SETTLED = np.radians(5.0)  # [rad] stddev of y₀ below which a contradiction leaves it alone
JOINT_BIAS_STDDEV = np.radians(4.0)  # [rad] by which cameras and a joint differ lastingly
JOINT_SKIN_STDDEV = np.radians(10.0)  # [rad] what skin adds, were it to swing like the joint
JOINT_BIAS_WALK = np.radians(1.5) ** 2 / 60.0  # [rad²/s] of that, likewise
JOINT_LIMIT = 5.0  # [-] standard deviations beyond which a joint's turn is not believed, nor
# beyond CONTRADICTION: then a world has turned, which cameras are to find
FULL_TURN = 2.0 * np.pi

# What is measured of an IMU's states: by a leaning axis, a lateral one, the same two where the
# mounting is known, and a neutral stand.
MEASURED = np.array(
    [
        [1.0, 0.0, 0.0, 0.0, 0.0],
        [1.0, 0.0, -1.0, 1.0, 0.0],
        [1.0, 0.0, 1.0, 0.0, 0.0],
        [1.0, 0.0, 0.0, 1.0, 0.0],
        [1.0, 0.0, 0.0, 0.0, 0.0],
    ]
)
LEAN, TURNED, LEAN_MOUNTED, TURNED_MOUNTED, STANDING = range(5)


@compiled_in_place
def wrapped(angle: float) -> float:
    """The same angle between −π and π [rad]."""
    return angle - FULL_TURN * np.rint(angle / FULL_TURN)


@compiled
def start(a: Anchors, i: int, heading: float, stddev: float) -> None:
    """Begin with a heading [rad] and its standard deviation [rad]."""
    forget_covariance(a, i)
    x, P = a.state[i], own_covariance(a, i)
    x[Y], x[DRIFT], x[Y0], x[LATERAL], x[BESIDE] = heading, 0.0, heading, 0.0, 0.0
    P[Y, Y] = P[Y, Y0] = P[Y0, Y] = P[Y0, Y0] = stddev**2
    P[DRIFT, DRIFT], P[LATERAL, LATERAL] = DRIFT_STDDEV**2, LATERAL_STDDEV**2
    P[BESIDE, BESIDE] = JOINT_BIAS_STDDEV**2
    a.joint_noise[i] = 0.0
    if a.is_mounting_known[i]:
        # There y₀ makes room for what the cameras lastingly see beside.
        bias = LEAN_BIAS_STDDEV**2
        x[Y0] = 0.0
        P[Y, Y] = stddev**2 + bias
        P[Y0, Y0] = bias
        P[Y, Y0] = P[Y0, Y] = -bias  # only their sum has been seen
    elif not np.isnan(a.neutral[i, 0]):
        keep_neutral(a, i, a.neutral[i, 0], a.neutral[i, 1])
    a.contradicted_s[i] = 0.0


@compiled
def keep_neutral(a: Anchors, i: int, heading: float, variance: float) -> None:
    """The mounting has been known before: it is the IMU's world that has turned."""
    x, P = a.state[i], own_covariance(a, i)
    x[Y0] = heading
    P[Y, Y0] = P[Y0, Y] = 0.0
    P[Y0, Y0] = variance


@compiled_in_place
def predict(a: Anchors, i: int, dt_s: float) -> None:
    """Let the heading drift on for ``dt_s`` [s]."""
    if not is_known(a, i) or dt_s <= 0.0:
        return
    P, first = a.covariance, STATES * i
    a.state[i, Y] += dt_s * a.state[i, DRIFT]
    of_heading, of_drift = P[first + Y], P[first + DRIFT]
    for k in range(len(P)):
        of_heading[k] += dt_s * of_drift[k]
    of_heading[first + Y] += dt_s * of_heading[first + DRIFT]
    for k in range(len(P)):
        P[k, first + Y] = of_heading[k]
    P[first + Y, first + Y] += dt_s * HEADING_WALK
    P[first + DRIFT, first + DRIFT] += dt_s * DRIFT_WALK
    P[first + BESIDE, first + BESIDE] += dt_s * JOINT_BIAS_WALK * a.joint_noise[i]


@compiled
def observe_standing(a: Anchors, i: int, heading: float, stddev: float) -> None:
    """Take the heading [rad] that a neutral stand tells, where the mounting is known."""
    if not is_known(a, i):
        start(a, i, heading, stddev)
        P = own_covariance(a, i)
        P[Y, Y] = stddev**2
        P[Y, Y0] = P[Y0, Y] = 0.0
        return
    update(a, i, wrapped(heading - a.state[i, Y]), STANDING, stddev**2)


@compiled_in_place
def compare(axis_world: FloatArray, axis_map: FloatArray) -> tuple[float, float, float]:
    """Dot and cross product of the horizontal parts, and how far they lean [-] together."""
    dot = axis_world[0] * axis_map[0] + axis_world[1] * axis_map[1]
    cross = axis_world[0] * axis_map[1] - axis_world[1] * axis_map[0]
    return dot, cross, np.sqrt(np.hypot(dot, cross))


@compiled
def observe_lean(
    a: Anchors, i: int, dt_s: float, axis_world: FloatArray, axis_map: FloatArray
) -> None:
    """See :meth:`pose_core.imu.heading.HeadingAnchor.observe_lean`."""
    a.unseen_s[i] += dt_s
    dot, cross, lean = compare(axis_world, axis_map)
    if np.isnan(lean):
        return
    fresh = np.empty((2, 3))
    rate = take_fresh_part(a.recent_axes[i], a.unseen_s[i], axis_world, axis_map, fresh)
    a.unseen_s[i] = 0.0
    dt_s = min(dt_s, LONGEST_STEP_S)
    was_known = is_known(a, i)
    if was_known and not np.isnan(rate):
        correct_by_fresh_part(a, i, dt_s, fresh, rate)
    if not lean > LEAST_LEAN:
        return
    keep = np.exp(-dt_s / RECENT_S)
    a.recent[i, 0] = keep * a.recent[i, 0] + dt_s * dot
    a.recent[i, 1] = keep * a.recent[i, 1] + dt_s * cross
    if was_known:
        watch(a, i, dt_s)
        return
    strength = np.hypot(a.recent[i, 0], a.recent[i, 1])
    if strength > FIRST_LEAN_S:
        stddev = AXIS_STDDEV * np.sqrt(CORRELATION_S / strength)
        start(a, i, np.arctan2(a.recent[i, 1], a.recent[i, 0]), stddev)


@compiled
def correct_by_fresh_part(a: Anchors, i: int, dt_s: float, fresh: FloatArray, rate: float) -> None:
    """Take the angle about the vertical between an axis' fresh parts, as far as it is small.

    Args:
        a: The IMUs.
        i: Which of them.
        dt_s: Time [s] that this instant stands for.
        fresh: The fresh part as the IMU and as the cameras see it, (2, 3).
        rate: At which the axis turns [rad/s].
    """
    which = LEAN_MOUNTED if a.is_mounting_known[i] else LEAN
    heading = a.state[i, Y] + (a.state[i, Y0] if a.is_mounting_known[i] else 0.0)
    c, s = np.cos(heading), np.sin(heading)
    x, y = c * fresh[0, 0] - s * fresh[0, 1], s * fresh[0, 0] + c * fresh[0, 1]
    length = np.hypot(x, y)
    if dt_s <= 0.0 or not length > LEAST_FRESH:
        return
    stddev = np.hypot(FRESH_STDDEV, TURNING_STDDEV * min(rate, FASTEST)) / length
    # No arc tangent: an error is often longer than the fresh part.
    angle = (x * fresh[1, 1] - y * fresh[1, 0]) / length**2
    correct(a, i, angle, stddev, FRESH_CORRELATION_S / dt_s, which)


@compiled
def observe_turned(
    a: Anchors,
    i: int,
    dt_s: float,
    axis_world: FloatArray,
    axis_map: FloatArray,
    sharpness: float,
) -> None:
    """See :meth:`pose_core.imu.heading.HeadingAnchor.observe_turned`."""
    dot, cross, lean = compare(axis_world, axis_map)
    lean *= sharpness
    if not lean > LEAST_LEAN:  # false of NaN
        return
    if is_known(a, i):
        dt_s = min(dt_s, LONGEST_STEP_S)
        correct_by_lateral_axis(a, i, dt_s, np.arctan2(cross, dot), lean)
    elif a.is_mounting_known[i]:
        # Before any lean: as good as the cameras see this line beside its place.
        variance = LATERAL_STDDEV**2 + (AXIS_STDDEV / lean) ** 2
        start(a, i, np.arctan2(cross, dot), np.sqrt(variance))
        P = own_covariance(a, i)
        P[Y, Y] = variance
        P[Y, Y0] = P[Y0, Y] = 0.0
        P[Y, LATERAL] = P[LATERAL, Y] = -(LATERAL_STDDEV**2)


@compiled
def correct_by_lateral_axis(a: Anchors, i: int, dt_s: float, angle: float, lean: float) -> None:
    """Take an angle [rad] about the vertical between where the IMU and where the cameras see it."""
    if dt_s <= 0.0:
        return
    # y₀ has been taken up already where the axis was brought into the world.
    innovation = wrapped(angle - a.state[i, Y] - a.state[i, LATERAL])
    which = TURNED_MOUNTED if a.is_mounting_known[i] else TURNED
    correct(a, i, innovation, AXIS_STDDEV / lean, CORRELATION_S / dt_s, which)


@compiled
def correct(
    a: Anchors, i: int, innovation: float, stddev: float, samples_alike: float, which: int
) -> None:
    """Take an innovation [rad] of this standard deviation [rad], limited.

    Its samples err alike, so many of them [-] count as one. The innovation itself errs by its
    standard deviation, however short the instant: that is where it is limited.
    """
    variance, P = stddev**2, own_covariance(a, i)
    for k in range(STATES):
        for m in range(STATES):
            variance += MEASURED[which, k] * P[k, m] * MEASURED[which, m]
    limit = LIMIT * np.sqrt(variance)
    update(a, i, min(max(innovation, -limit), limit), which, stddev**2 * samples_alike)


@compiled
def update(a: Anchors, i: int, innovation: float, which: int, noise: float) -> None:
    """Kalman's update with one measurement, a row of :data:`MEASURED`."""
    P, first, variance = a.covariance, STATES * i, noise
    PH = np.zeros(len(P))
    for k in range(STATES):
        share = MEASURED[which, k]
        if share != 0.0:
            for m in range(len(P)):
                PH[m] += share * P[first + k, m]
    for k in range(STATES):
        variance += MEASURED[which, k] * PH[first + k]
    take_up(a.state, P, PH, innovation, variance)


@compiled_in_place
def take_up(
    state: FloatArray, P: FloatArray, PH: FloatArray, innovation: float, variance: float
) -> None:
    """Kalman's update of all IMUs' states.

    Args:
        state: See :class:`Anchors`.
        P: Their covariance.
        PH: Covariance of the states and what is measured, (5 n,); is overwritten.
        innovation: How far that is from what was expected [rad].
        variance: Of the innovation [rad²].
    """
    length = 1.0 / np.sqrt(variance)
    for k in range(len(PH)):
        PH[k] *= length
    for k in range(len(PH)):
        gain = PH[k]
        if gain != 0.0:  # most others' are, as long as no joint ties them
            state[k // STATES, k % STATES] += gain * length * innovation
            row = P[k]
            for m in range(len(PH)):
                row[m] -= gain * PH[m]


@compiled
def relate(a: Anchors, child: int, parent: int, turn: float, variance: float, noise: float) -> bool:
    """Take how the worlds of two IMUs are turned that a joint connects.

    Args:
        a: The IMUs.
        child: The IMU of the segment beyond the joint.
        parent: That of the segment before it.
        turn: The child's heading less the parent's [rad].
        variance: Of what of it is not alike from one to the next [rad²].
        noise: Variance of what the joint shows, against what it measures [-]: in proportion to it,
            the turn may lastingly be shown beside.

    Returns:
        Whether it did not contradict what is known.
    """
    if not is_known(a, child) or not is_known(a, parent):
        return True
    y, up, beside = STATES * child + Y, STATES * parent + Y, STATES * child + BESIDE
    if a.joint_noise[child] == 0.0:
        a.covariance[beside, beside] += noise * JOINT_SKIN_STDDEV**2
    a.joint_noise[child] = noise
    PH = a.covariance[y] - a.covariance[up] + a.covariance[beside]
    variance += PH[y] - PH[up] + PH[beside]
    shown = a.state[child, Y] - a.state[parent, Y] + a.state[child, BESIDE]
    innovation = wrapped(turn - shown)
    if innovation**2 > min(JOINT_LIMIT**2 * variance, CONTRADICTION**2):
        return False
    take_up(a.state, a.covariance, PH, innovation, variance)
    return True


@compiled
def watch(a: Anchors, i: int, dt_s: float) -> None:
    """Begin anew from the last seconds where they contradict all that was before."""
    dot, cross = a.recent[i]
    recent = np.arctan2(cross, dot)
    is_other = abs(wrapped(recent - a.state[i, Y])) > CONTRADICTION
    if not is_other or np.hypot(dot, cross) < RECENT_LEAST_S:
        a.contradicted_s[i] = 0.0
        return
    a.contradicted_s[i] += dt_s
    if a.contradicted_s[i] < CONTRADICTED_S:
        return
    neutral, variance = a.state[i, Y0], own_covariance(a, i)[Y0, Y0]
    start(a, i, recent, RESTART_STDDEV)
    a.restarts[i] += 1
    if not a.is_mounting_known[i] and variance < SETTLED**2:
        keep_neutral(a, i, neutral, variance)


@compiled
def lose_heading(a: Anchors, i: int) -> None:
    """The IMU's world may have turned to anywhere; the neutral pose's heading stays known."""
    if not is_known(a, i):
        return
    a.neutral[i, 0], a.neutral[i, 1] = a.state[i, Y0], own_covariance(a, i)[Y0, Y0]
    a.state[i] = np.nan
    forget_covariance(a, i)
    a.recent[i] = 0.0
    a.unseen_s[i] = np.inf
