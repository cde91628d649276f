"""Joint angles, rates and variances from links' rotations: the inverse of the chain."""

from typing import NamedTuple

import numpy as np

from pose_fusion.kernels.compiling import compiled
from pose_fusion.kernels.forward import ModelNumbers
from pose_fusion.kernels.rotations import exponential, logarithm, product, transposed_product
from pose_fusion.kernels.small_matrices import solve
from pose_fusion.streams.samples import FloatArray

FULL_TURN = 2.0 * np.pi
RATE_DAMPING = 0.05  # [-] of the rates where two axes of a joint nearly coincide
VARIANCE_DAMPING = 0.1  # [-] likewise of an angle's variance
BEYOND = 4.0  # [-] weight of a square beyond the limits, to one from the angles before
WOUND_UP = 1.5 * np.pi  # [rad] that no angle reaches near the neutral pose
NEARLY_NEUTRAL = np.cos(np.radians(45.0))  # [-] of a limb's tilt, below which its angles are plain


class StateNumbers(NamedTuple):
    """What of a segment filter's state is told, whenever that is; of n states: n rows of each."""

    position: FloatArray  # (3,) [m] of the root
    velocity: FloatArray  # (3,) [m/s]
    rotations: FloatArray  # (links, 3, 3): R_map_link
    rates: FloatArray  # (links, 3) [rad/s] in map
    turns: FloatArray  # (links, 3) [rad] what the pose glides by, see Glide
    shift: FloatArray  # (3,) [m] likewise
    place_variance: FloatArray  # (3,) [m²] of the root's position
    covariance: FloatArray  # (links, 3, 3) [rad²] of each link's turn, relative to its parent's
    information: FloatArray  # (2, links, 3, 3) [1/rad²] of each source on each link
    scale: FloatArray  # (1,) [-] of the variances


@compiled
def moved_axes(R: FloatArray, axes: FloatArray, angles: FloatArray, out: FloatArray) -> None:
    """A joint's axes, (k, 3), in map, each moved by the turns [rad] before it; R: the parent's."""
    rotation, turn, before = R.copy(), np.empty((3, 3)), np.empty((3, 3))
    for index in range(len(angles)):
        a = axes[index]
        for i in range(3):
            out[index, i] = rotation[i, 0] * a[0] + rotation[i, 1] * a[1] + rotation[i, 2] * a[2]
        angle = angles[index]
        exponential(angle * a[0], angle * a[1], angle * a[2], turn)
        before[:] = rotation
        product(before, turn, rotation)


@compiled
def link_angles(
    R_parent_link: FloatArray,
    signs: FloatArray,
    limits: FloatArray,
    previous: FloatArray,
    out: FloatArray,
) -> None:
    """A link's joint angles [rad], of the equivalent answers the one nearest to the previous.

    Of a ball joint's angles a, b, c about y, x and z, a + π, π − b, c + π is the same rotation.
    Nearest is by the turn between the two, for which

        Δ² = Δa² + Δb² + Δc² − 2 sin b Δa Δc                                               (1)

    holds of small ones. Where b is a quarter turn, an arm stretched sideways, both answers meet,
    and the one that a body can reach is taken: else arms that swing past there wind up. A limb
    that hangs nearly as in the neutral pose has one such answer only, and whatever wrongly seen
    joints have wound up is unwound there.

    Args:
        R_parent_link: The link's rotation in its parent, (3, 3).
        signs: Of its axes: three (about ∓y, ±x, ∓z), two (y, x) or one (∓y).
        limits: Of its angles, lower and upper, (k, 2) [rad].
        previous: The angles before.
        out: The angles.
    """
    R, count = R_parent_link, len(signs)
    if count == 1:
        # Between the two bones, as a camera would measure it; never negative.
        out[0] = np.arctan2(np.hypot(R[0, 2], R[1, 2]), R[2, 2])
        return
    about_x = np.arcsin(min(max(-R[1, 2], -1.0), 1.0))
    about_y = np.arctan2(R[0, 2], R[2, 2])
    if count == 2:
        out[0] = nearest_turn(signs[0] * about_y, previous[0])
        out[1] = nearest_turn(signs[1] * about_x, previous[1])
        return
    about_z = np.arctan2(R[1, 0], R[1, 1])
    if R[2, 2] > NEARLY_NEUTRAL:
        plain = (signs[0] * about_y, signs[1] * about_x, signs[2] * about_z)
        for k in range(3):
            out[k] = nearest_turn(plain[k], previous[k])
            if abs(out[k]) > WOUND_UP:
                out[k] = plain[k]
        return
    answer, least = np.empty(3), np.inf
    for half_turns in range(2):
        x = about_x if half_turns == 0 else np.pi - about_x
        y0 = nearest_turn(signs[0] * (about_y + half_turns * np.pi), previous[0])
        z0 = nearest_turn(signs[2] * (about_z + half_turns * np.pi), previous[2])
        answer[1] = nearest_turn(signs[1] * x, previous[1])
        twist = signs[0] * signs[2] * np.sin(0.5 * signs[1] * (answer[1] + previous[1]))
        for y_turns in range(-1, 2):
            for z_turns in range(-1, 2):
                answer[0], answer[2] = y0 + y_turns * FULL_TURN, z0 + z_turns * FULL_TURN
                cost = -2.0 * twist * (answer[0] - previous[0]) * (answer[2] - previous[2])
                for k in range(3):
                    cost += (answer[k] - previous[k]) ** 2
                for k in range(2):  # the turn about itself of a straight limb is but guessed
                    beyond = max(limits[k, 0] - answer[k], answer[k] - limits[k, 1], 0.0)
                    cost += BEYOND * beyond**2
                if cost < least:
                    least = cost
                    out[:] = answer


@compiled
def nearest_turn(angle: float, previous: float) -> float:
    """The same angle [rad], by full turns as near to the previous one as can be."""
    return angle + FULL_TURN * np.round((previous - angle) / FULL_TURN)


@compiled
def least_squares(A: FloatArray, B: FloatArray, damping: float, out: FloatArray) -> None:
    """(A Aᵀ + damping² I)⁻¹ A B, damped where the rows of A, (k, 3), are nearly dependent."""
    count = len(A)
    normal = np.empty((3, 3))
    for i in range(count):
        for k in range(count):
            normal[i, k] = A[i, 0] * A[k, 0] + A[i, 1] * A[k, 1] + A[i, 2] * A[k, 2]
        normal[i, i] += damping**2
        for column in range(B.shape[1]):
            out[i, column] = 0.0
            for m in range(3):
                out[i, column] += A[i, m] * B[m, column]
    solve(normal, out, count)


@compiled
def continuous_vector(vector: FloatArray, previous: FloatArray, out: FloatArray) -> None:
    """The rotation vector [rad] of the same rotation that lies nearest to the previous one."""
    angle = np.sqrt(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2)
    if angle == 0.0:
        # Any direction will do for full turns: keep the previous one's.
        length = np.sqrt(previous[0] ** 2 + previous[1] ** 2 + previous[2] ** 2)
        turns = np.round(length / FULL_TURN)
        for axis in range(3):
            has_turned = turns != 0.0
            out[axis] = previous[axis] / length * turns * FULL_TURN if has_turned else vector[axis]
        return
    along = 0.0
    for axis in range(3):
        along += vector[axis] / angle * previous[axis]
    turns = np.round((along - angle) / FULL_TURN)
    for axis in range(3):
        out[axis] = (angle + turns * FULL_TURN) * vector[axis] / angle


@compiled
def read_pose(
    numbers: ModelNumbers,
    position: FloatArray,
    rotations: FloatArray,
    state: StateNumbers,
    previous: FloatArray,
    out: FloatArray,
) -> None:
    """All degrees of freedom.

    Args:
        numbers: The body model.
        position: Of the root as it goes out, (3,) [m].
        rotations: ``R_map_link`` as they go out, (links, 3, 3).
        state: Rates, covariance and information.
        previous: The degrees of freedom before, (d,).
        out: (5, d): values, rates, variances, then each source's information.
    """
    relative, vector = np.empty((3, 3)), np.empty(3)
    for axis in range(3):
        out[0, axis], out[1, axis] = position[axis], state.velocity[axis]
        out[2, axis] = state.place_variance[axis]
    for link in range(len(numbers.parents)):
        parent = numbers.parents[link]
        if parent < 0:
            logarithm(rotations[link], vector)
            continuous_vector(vector, previous[3:6], out[0, 3:6])
            for axis in range(3):
                out[1, 3 + axis] = state.rates[link, axis]
                out[2, 3 + axis] = state.covariance[link, axis, axis]
            for source in range(2):
                own = state.information[source, link]
                out[3 + source, :6] = (own[0, 0] + own[1, 1] + own[2, 2]) / 3.0
            continue
        transposed_product(rotations[parent], rotations[link], relative)
        read_link(numbers, link, relative, rotations[parent], state, previous, out)


@compiled
def read_link(
    numbers: ModelNumbers,
    link: int,
    R_parent_link: FloatArray,
    R_map_parent: FloatArray,
    state: StateNumbers,
    previous: FloatArray,
    out: FloatArray,
) -> None:
    """One link's degrees of freedom; see :func:`read_pose`."""
    count = numbers.dof_count[link]
    dof, axes = numbers.dof[link, :count], numbers.axes[link, :count]
    signs, before, angles = np.empty(count), np.empty(count), np.empty(count)
    A, rates, inverse = np.empty((count, 3)), np.empty((count, 1)), np.empty((count, 3))
    for k in range(count):
        signs[k], before[k] = axes[k, 0] + axes[k, 1] + axes[k, 2], previous[dof[k]]
    link_angles(R_parent_link, signs, numbers.limits[link, :count], before, angles)
    moved_axes(R_map_parent, axes, angles, A)
    omega = (state.rates[link] - state.rates[numbers.parents[link]]).reshape(3, 1)
    least_squares(A, omega, RATE_DAMPING, rates)
    least_squares(A, np.eye(3), VARIANCE_DAMPING, inverse)
    for k in range(count):
        variance, known = 0.0, np.zeros(2)
        for a in range(3):
            for b in range(3):
                variance += inverse[k, a] * state.covariance[link, a, b] * inverse[k, b]
                for source in range(2):
                    known[source] += A[k, a] * state.information[source, link, a, b] * A[k, b]
        at = dof[k]
        out[0, at], out[1, at], out[2, at] = angles[k], rates[k, 0], variance
        out[3, at], out[4, at] = known[0], known[1]
