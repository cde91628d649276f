r"""How the worlds of two IMUs are turned that a joint connects: by what both tell of its motion.

Each IMU tells the joint's acceleration in its own world, if the joint's place in the sensor's
frame is known (:mod:`pose_core.kernels.joint_series`). With the horizontal parts as complex
numbers, :math:`h_p` of the parent's IMU and :math:`h_c` of the child's, and the vertical ones,
:math:`v`, least squares over a window

.. math:: \min_{\delta, r_p, r_c} \sum |h_p(r_p) - e^{i\delta} h_c(r_c)|^2 + (v_p(r_p) - v_c(r_c))^2

give the turn :math:`\delta` from the child's world to the parent's, of every window by itself, and
the places, which later windows begin with. Means over the window are taken off before: gravity is
in them, and what a wrong tilt makes of it. All that is needed are the window's sums of products, 8
by 8. What is left over is the noise: skin that swings, and joints that are none.

References:
    Weygers et al. (2020), IEEE Sensors Journal 20(14); Kok, Eckhoff, Weygers, Seel (2022), Control
    Engineering Practice 125: such constraints in filters, smoothers, and what they show.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pose_core.kernels.compiling import compiled
from pose_core.kernels.joint_series import INTERVAL_NS, JointSeries, tell_accelerations
from pose_core.kernels.small_matrices import solve
from pose_core.streams.samples import FloatArray

WINDOW = 40  # [-] instants
LEAST_KNOWN = 36  # [-] of these
WINDOW_S = WINDOW * INTERVAL_NS * 1e-9  # [s]
PLACE_STDDEV = 0.2  # [m] of a joint in a sensor's frame, before anything is known, each axis
FORGETTING_S = 1200.0  # [s] over which places are forgotten: straps slip
ALIKE = 4.0  # [-] instants whose noise counts as one
QUIET = 0.03  # [m/s²] noise of an instant that is always there
LEAST_MOTION = 0.15  # [m/s²] of the joint, in a window that shows anything
MOST_NOISE = 1.0  # [-] variance of an instant's noise against the motion's, in such a window
STEPS = 4  # [-] of Gauss and Newton in a window
PLACES = np.array([1, 2, 3, 5, 6, 7])  # of θ = (1, r_p, 1, r_c)


class JointTurns(NamedTuple):
    """What is known of m joints."""

    imus: NDArray[np.int64]  # (m, 2) the parent's and the child's
    places: FloatArray  # (m, 6) [m] of the joint in the parent's sensor, and in the child's
    information: FloatArray  # (m, 6, 6) of these [1/m²]
    next_window: NDArray[np.int64]  # (m,)


def make_joint_turns(imus: NDArray[np.int64]) -> JointTurns:
    """Of joints between these IMUs, (m, 2), of which nothing is known."""
    count = len(imus)
    return JointTurns(
        imus=imus,
        places=np.zeros((count, 6)),
        information=np.tile(np.eye(6) / PLACE_STDDEV**2, (count, 1, 1)),
        next_window=np.zeros(count, np.int64),
    )


@compiled
def take_windows(
    joints: JointTurns, series: JointSeries, whole: NDArray[np.int64], found: FloatArray
) -> int:
    """Fit the windows that are whole by now.

    Args:
        joints: What is known; is updated.
        series: What the IMUs felt.
        whole: Filled: which joint and which window, (at least 3 m, 2).
        found: Filled: the turn [rad], its variance [rad²], and the variance of an instant's noise
            against the joint's motion [-], (at least 3 m, 3).

    Returns:
        How many there are.
    """
    count = 0
    for j in range(len(joints.imus)):
        parent, child = joints.imus[j]
        newest_ns = min(series.stamps_ns[parent], series.stamps_ns[child])
        if newest_ns == 0:
            continue
        # Two instants beyond a window's last one are needed.
        ready = (newest_ns // INTERVAL_NS - 1) // WINDOW
        if not ready - 2 <= joints.next_window[j] <= ready:
            joints.next_window[j] = ready - 1
        while joints.next_window[j] < ready:
            window = joints.next_window[j]
            joints.next_window[j] += 1
            if fit_window(joints, j, series, window * WINDOW, found[count]):
                whole[count, 0], whole[count, 1] = j, window
                count += 1
    return count


@compiled
def fit_window(
    joints: JointTurns, j: int, series: JointSeries, first: int, found: FloatArray
) -> bool:
    """Fit one window, from instant ``first`` on; whether it shows the turn."""
    told = np.empty((2, WINDOW, 3, 4))
    tell_accelerations(series, joints.imus[j, 0], first, told[0])
    tell_accelerations(series, joints.imus[j, 1], first, told[1])
    flat, crossed, upright = np.zeros((8, 8)), np.zeros((8, 8)), np.zeros((8, 8))
    known = add_up(told, flat, crossed, upright)
    if known < LEAST_KNOWN:
        return False
    places, information = joints.places[j], joints.information[j]
    before, A, step = places.copy(), np.empty((6, 6)), np.empty((6, 1))
    theta, Q, shared = np.ones(8), np.empty((8, 8)), np.empty(8)
    turn, motion, noise = 0.0, 0.0, 0.0
    for _ in range(STEPS):
        theta[1:4], theta[5:8] = places[:3], places[3:]
        turn, motion = turn_between(theta, flat, crossed)
        add_all(turn, flat, crossed, upright, Q)
        noise = quadratic(theta, Q) / (3.0 * known) + QUIET**2
        power = follow_turn(theta, turn, flat, crossed, shared)
        weight = 1.0 / (ALIKE * noise)
        for k in range(6):
            row = PLACES[k]
            step[k, 0] = 0.0
            for m in range(8):
                step[k, 0] -= weight * Q[row, m] * theta[m]
            for m in range(6):
                # The turn, which is any, takes its part of what the window tells of the places.
                told_of = Q[row, PLACES[m]] - shared[row] * shared[PLACES[m]] / power
                A[k, m] = information[k, m] + weight * told_of
                step[k, 0] -= information[k, m] * (places[m] - before[m])
        gained = A.copy()
        solve(A, step, 6)
        places += step[:, 0]
    keep = np.exp(-WINDOW_S / FORGETTING_S)
    information[:] = keep * gained
    for k in range(6):
        information[k, k] += (1.0 - keep) / PLACE_STDDEV**2
    if not motion > 2.0 * known * LEAST_MOTION**2:
        return False
    found[0] = turn
    found[1] = ALIKE * noise / motion
    found[2] = 2.0 * known * noise / motion
    return found[2] < MOST_NOISE


@compiled
def turn_between(theta: FloatArray, flat: FloatArray, crossed: FloatArray) -> tuple[float, float]:
    """The turn [rad] that brings the child's horizontal parts best onto the parent's, for places.

    Also the sum of what both show alike [m²/s⁴].
    """
    along, across = 0.0, 0.0
    for k in range(4):
        for m in range(4, 8):
            along += theta[k] * flat[k, m] * theta[m]
            across += theta[k] * crossed[k, m] * theta[m]
    return -np.arctan2(across, along), np.hypot(along, across)


@compiled
def add_all(
    turn: float, flat: FloatArray, crossed: FloatArray, upright: FloatArray, Q: FloatArray
) -> None:
    """Fill Q, (8, 8): θᵀ Q θ is the sum of squares that is left over with a turn."""
    c, s = np.cos(turn), np.sin(turn)
    for k in range(4):
        for m in range(4):
            Q[k, m] = flat[k, m] + upright[k, m]
            Q[4 + k, 4 + m] = flat[4 + k, 4 + m] + upright[4 + k, 4 + m]
            Q[k, 4 + m] = s * crossed[k, 4 + m] - c * flat[k, 4 + m] - upright[k, 4 + m]
            Q[4 + m, k] = Q[k, 4 + m]


@compiled
def follow_turn(
    theta: FloatArray, turn: float, flat: FloatArray, crossed: FloatArray, shared: FloatArray
) -> float:
    """How what is left over changes with the turn.

    Args:
        theta: The places, (8,).
        turn: The turn [rad].
        flat: See :func:`add_up`.
        crossed: Likewise.
        shared: Filled, (8,): its product with how the same changes with the places.

    Returns:
        Its square, of all instants.
    """
    c, s, power = np.cos(turn), np.sin(turn), 1e-12
    for k in range(4):
        shared[k], shared[4 + k] = 0.0, 0.0
        for m in range(4, 8):
            shared[k] += (s * flat[k, m] + c * crossed[k, m]) * theta[m]
            shared[4 + k] -= crossed[4 + k, m] * theta[m]
            power += theta[4 + k] * flat[4 + k, m] * theta[m]
    return power


@compiled
def quadratic(theta: FloatArray, Q: FloatArray) -> float:
    """The form θᵀ Q θ."""
    total = 0.0
    for k in range(len(theta)):
        for m in range(len(theta)):
            total += theta[k] * Q[k, m] * theta[m]
    return total


@compiled
def add_up(told: FloatArray, flat: FloatArray, crossed: FloatArray, upright: FloatArray) -> int:
    """Sums of products of what two IMUs tell, about its means, over a window.

    Args:
        told: (2, window, 3, 4), NaN where not known.
        flat: Filled: of the real and of the imaginary horizontal parts, (8, 8).
        crossed: Filled: of the real and the imaginary ones less the reverse, (8, 8).
        upright: Filled: of the vertical parts, (8, 8).

    Returns:
        At how many instants both are known.
    """
    values, mean, known = np.empty((3, 8)), np.zeros((3, 8)), 0
    is_known = np.zeros(told.shape[1], np.bool_)
    for n in range(told.shape[1]):
        is_known[n] = not np.isnan(told[:, n]).any()
        if is_known[n]:
            known += 1
            for row in range(3):
                for k in range(4):
                    mean[row, k] += told[0, n, row, k]
                    mean[row, 4 + k] += told[1, n, row, k]
    mean /= max(known, 1)
    for n in range(told.shape[1]):
        if not is_known[n]:
            continue
        for row in range(3):
            for k in range(4):
                values[row, k] = told[0, n, row, k] - mean[row, k]
                values[row, 4 + k] = told[1, n, row, k] - mean[row, 4 + k]
        for k in range(8):
            for m in range(8):
                flat[k, m] += values[0, k] * values[0, m] + values[1, k] * values[1, m]
                crossed[k, m] += values[0, k] * values[1, m] - values[1, k] * values[0, m]
                upright[k, m] += values[2, k] * values[2, m]
    return known
