"""Joint angles, rates and variances from links' rotations: the inverse of the chain."""

from typing import NamedTuple

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.kernels.compiling import compiled_in_place, compiled_into_caller
from pose_core.kernels.forward_kinematics import ModelArrays
from pose_core.kernels.linear_algebra import Symmetric, dot, inverse
from pose_core.kernels.published_state import CAMERAS, IMUS, DofEstimate, PublishedState
from pose_core.kernels.rotations import logarithm, transposed_product

FULL_TURN = 2.0 * np.pi
RATE_DAMPING = 0.05  # [-] damping of the rates where two axes of a joint nearly coincide
VARIANCE_DAMPING = 0.1  # [-] the same for the variance of an angle
LIMIT_WEIGHT = 4.0  # [-] weight of a squared violation of limits, relative to a squared change
NEARLY_NEUTRAL = np.cos(np.radians(45.0))  # [-] of a tilt, below which angles are unique


@compiled_into_caller
def moved_axes(R: FloatArray, axes: FloatArray, angles: FloatArray, out: FloatArray) -> None:
    """A joint's axes in map, (k, 3), moved by the preceding rotations [rad]; R: the parent's."""
    for index in range(len(angles)):
        x, y, z = axes[index, 0], axes[index, 1], axes[index, 2]
        for before in range(index - 1, -1, -1):
            x, y, z = turned(angles[before], axes[before], x, y, z)
        for i in range(3):
            out[index, i] = R[i, 0] * x + R[i, 1] * y + R[i, 2] * z


@compiled_in_place
def turned(
    angle: float, axis: FloatArray, x: float, y: float, z: float
) -> tuple[float, float, float]:
    """Rotate a vector by an angle [rad] about a unit axis."""
    sine, rest = np.sin(angle), 1.0 - np.cos(angle)
    a, b, c = axis[0], axis[1], axis[2]
    u, v, w = b * z - c * y, c * x - a * z, a * y - b * x
    x += sine * u + rest * (b * w - c * v)
    y += sine * v + rest * (c * u - a * w)
    z += sine * w + rest * (a * v - b * u)
    return x, y, z


@compiled_in_place
def link_angles(
    R_parent_link: FloatArray,
    signs: FloatArray,
    limits: FloatArray,
    previous: FloatArray,
    out: FloatArray,
) -> None:
    """A link's joint angles [rad]: of the equivalent solutions, the nearest within the limits.

    For a ball joint's angles a, b, c about y, x and z, a + π, π − b, c + π is the same rotation.
    The distance to the previous angles is the rotation between the two, for which

        Δ² = Δa² + Δb² + Δc² − 2 sin b Δa Δc                                               (1)

    holds if it is small. If b is a quarter turn (an arm stretched sideways), both solutions meet:
    there Δ is zero, and the solution within the limits is used. A limb that is close to the
    neutral pose has only one such solution.

    Args:
        R_parent_link: The link's rotation in its parent, (3, 3).
        signs: Signs of its axes: three (about ∓y, ±x, ∓z), two (y, x) or one (∓y).
        limits: Lower and upper limits, (k, 2) [rad]; every range is less than a full turn.
        previous: The previously published angles.
        out: Filled with the angles; outside the limits if no solution lies within.
    """
    R, count = R_parent_link, len(signs)
    if count == 1:
        # Between the two bones, as a camera would measure it; never negative.
        out[0] = np.arctan2(np.hypot(R[0, 2], R[1, 2]), R[2, 2])
        return
    about_x = np.arcsin(min(max(-R[1, 2], -1.0), 1.0))
    about_y = np.arctan2(R[0, 2], R[2, 2])
    if count == 2:
        out[0] = wrapped_into_limits(signs[0] * about_y, limits[0], previous[0])
        out[1] = wrapped_into_limits(signs[1] * about_x, limits[1], previous[1])
        return
    about_z = np.arctan2(R[1, 0], R[1, 1])
    least = np.inf
    for half_turns in range(2):
        if half_turns == 1 and R[2, 2] > NEARLY_NEUTRAL:
            break
        x = about_x if half_turns == 0 else np.pi - about_x
        y = wrapped_into_limits(signs[0] * (about_y + half_turns * np.pi), limits[0], previous[0])
        x = wrapped_into_limits(signs[1] * x, limits[1], previous[1])
        z = wrapped_into_limits(signs[2] * (about_z + half_turns * np.pi), limits[2], previous[2])
        twist = signs[0] * signs[2] * np.sin(0.5 * signs[1] * (x + previous[1]))
        dy, dx, dz = y - previous[0], x - previous[1], z - previous[2]
        cost = dy * dy + dx * dx + dz * dz - 2.0 * twist * dy * dz  # (1)
        squared = beyond(y, limits[0]) ** 2 + beyond(x, limits[1]) ** 2 + beyond(z, limits[2]) ** 2
        cost += LIMIT_WEIGHT * squared
        if cost < least:
            least = cost
            out[0], out[1], out[2] = y, x, z


@compiled_in_place
def wrapped_into_limits(angle: float, limits: FloatArray, previous: float) -> float:
    """The equivalent angle [rad] within limits, (2,), otherwise the one nearest to another."""
    middle = wrapped_nearest(angle, 0.5 * (limits[0] + limits[1]))
    return middle if beyond(middle, limits) == 0.0 else wrapped_nearest(angle, previous)


@compiled_in_place
def beyond(angle: float, limits: FloatArray) -> float:
    """Violation of limits, (2,), by an angle [rad]; 0 within them."""
    return max(limits[0] - angle, angle - limits[1], 0.0)


@compiled_into_caller
def wrapped_nearest(angle: float, previous: float) -> float:
    """The equivalent angle [rad], modulo full turns, nearest to the previous one."""
    return angle + FULL_TURN * np.round((previous - angle) / FULL_TURN)


@compiled_into_caller
def least_squares(A: FloatArray, B: FloatArray, damping: float, out: FloatArray) -> None:
    """(A Aᵀ + damping² I)⁻¹ A B, damped where the rows of A, (k, 3), are nearly dependent."""
    count, least = len(A), damping**2
    xy = xz = yz = 0.0
    yy = zz = 1.0
    xx = dot(A[0], A[0]) + least
    if count > 1:
        xy, yy = dot(A[0], A[1]), dot(A[1], A[1]) + least
    if count > 2:
        xz, yz, zz = dot(A[0], A[2]), dot(A[1], A[2]), dot(A[2], A[2]) + least
    N = inverse(Symmetric(xx, xy, xz, yy, yz, zz))
    for column in range(B.shape[1]):
        x = y = z = 0.0
        for m in range(3):
            x += A[0, m] * B[m, column]
            if count > 1:
                y += A[1, m] * B[m, column]
            if count > 2:
                z += A[2, m] * B[m, column]
        out[0, column] = N.xx * x + N.xy * y + N.xz * z
        if count > 1:
            out[1, column] = N.xy * x + N.yy * y + N.yz * z
        if count > 2:
            out[2, column] = N.xz * x + N.yz * y + N.zz * z


@compiled_in_place
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


@compiled_into_caller
def extract_pose(
    model: ModelArrays,
    rotations: FloatArray,
    state: PublishedState,
    previous: FloatArray,
    out: DofEstimate,
) -> None:
    """Extract all degrees of freedom.

    Args:
        model: The body model.
        rotations: Published ``R_map_link``, (links, 3, 3).
        state: Position of the root, rates, covariance and information.
        previous: The previous degrees of freedom, (d,).
        out: Filled, except ``blended``.
    """
    work = make_workspace()
    extract_root(rotations[0], state, previous, work, out)
    for link in range(1, len(model.parents)):
        extract_link(model, link, rotations, state, previous, work, out)


class Workspace(NamedTuple):
    """Intermediate values of one link."""

    relative: FloatArray  # (3, 3) rotation in the parent
    vector: FloatArray  # (3,) its vector
    signs: FloatArray  # (3,) of the joint's axes
    before: FloatArray  # (3,) [rad] the angles before
    angles: FloatArray  # (3,) [rad]
    omega: FloatArray  # (3, 1) [rad/s] in map
    rates: FloatArray  # (3, 1) [rad/s]
    axes: FloatArray  # (3, 3) in map
    inverse: FloatArray  # (3, 3) of the axes
    unit: FloatArray  # (3, 3) the unit matrix


@compiled_into_caller
def make_workspace() -> Workspace:
    """Allocate the workspace."""
    return Workspace(
        np.empty((3, 3)),
        np.empty(3),
        np.empty(3),
        np.empty(3),
        np.empty(3),
        np.empty((3, 1)),
        np.empty((3, 1)),
        np.empty((3, 3)),
        np.empty((3, 3)),
        np.eye(3),
    )


@compiled_in_place
def extract_root(
    R_map_root: FloatArray,
    state: PublishedState,
    previous: FloatArray,
    work: Workspace,
    out: DofEstimate,
) -> None:
    """Extract the degrees of freedom of the root; see :func:`extract_pose`."""
    for axis in range(3):
        out.position[axis], out.velocity[axis] = state.position[axis], state.velocity[axis]
        out.variance[axis] = state.position_variance[axis]
        out.velocity[3 + axis] = state.rates[0, axis]
        out.variance[3 + axis] = state.covariance[0, axis, axis]
    logarithm(R_map_root, work.vector)
    continuous_vector(work.vector, previous[3:6], out.position[3:6])
    for source in range(2):
        own = state.information[source, 0]
        for at in range(6):
            out.information[source, at] = (own[0, 0] + own[1, 1] + own[2, 2]) / 3.0


@compiled_in_place
def extract_link(
    model: ModelArrays,
    link: int,
    rotations: FloatArray,
    state: PublishedState,
    previous: FloatArray,
    work: Workspace,
    out: DofEstimate,
) -> None:
    """Extract one link's degrees of freedom; see :func:`extract_pose`."""
    count, parent = model.dof_count[link], model.parents[link]
    dof, axes = model.dof[link, :count], model.axes[link, :count]
    signs, before, angles = work.signs[:count], work.before[:count], work.angles[:count]
    A, rates, inverted = work.axes[:count], work.rates[:count], work.inverse[:count]
    for k in range(count):
        signs[k], before[k] = axes[k, 0] + axes[k, 1] + axes[k, 2], previous[dof[k]]
    transposed_product(rotations[parent], rotations[link], work.relative)
    link_angles(work.relative, signs, model.limits[link, :count], before, angles)
    moved_axes(rotations[parent], axes, angles, A)
    for axis in range(3):
        work.omega[axis, 0] = state.rates[link, axis] - state.rates[parent, axis]
    least_squares(A, work.omega, RATE_DAMPING, rates)
    least_squares(A, work.unit, VARIANCE_DAMPING, inverted)
    for k in range(count):
        variance = kinects = imus = 0.0
        for a in range(3):
            for b in range(3):
                variance += inverted[k, a] * state.covariance[link, a, b] * inverted[k, b]
                kinects += A[k, a] * state.information[CAMERAS, link, a, b] * A[k, b]
                imus += A[k, a] * state.information[IMUS, link, a, b] * A[k, b]
        at = dof[k]
        out.position[at], out.velocity[at], out.variance[at] = angles[k], rates[k, 0], variance
        out.information[CAMERAS, at], out.information[IMUS, at] = kinects, imus
