"""What goes out for states: the gliding pose, its degrees of freedom, their uncertainty."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pose_core.kernels.compiling import compiled, compiled_in_place
from pose_core.kernels.forward import ModelNumbers, place_links
from pose_core.kernels.frames import place_origins
from pose_core.kernels.gliding import Glide, is_over
from pose_core.kernels.hinge_plane import Hinges, turn_into_hinge_planes
from pose_core.kernels.placing import Pose
from pose_core.kernels.reading import StateNumbers, read_pose
from pose_core.kernels.rotations import turn_all
from pose_core.kernels.seeing import share_cameras
from pose_core.streams.samples import FloatArray

NOTHING = 1e-6  # [1/rad²] information that is none


class BodyAsTold(NamedTuple):
    """What one body's poses are told with."""

    numbers: ModelNumbers
    hinges: Hinges
    trusts: FloatArray  # see :func:`published_variance`


class Told(NamedTuple):
    """What is told of n states: filled."""

    position: FloatArray  # (n, d) [m] or [rad]
    velocity: FloatArray  # (n, d)
    variance: FloatArray  # (n, d)
    weight_kinect: FloatArray  # (n, d) [-]
    weight_imu: FloatArray  # (n, d) [-]
    source: NDArray[np.uint8]  # (n, d)
    joints: FloatArray  # (n, joints, 3) [m]: of the pose that the degrees of freedom give
    T_map_link: FloatArray  # (n, links, 4, 4): likewise
    sensor_weight: FloatArray  # (n, s, joints) [-]


@compiled_in_place
def keep(
    pose: Pose,
    P: FloatArray,
    parents: NDArray[np.int64],
    glide: Glide,
    scale: float,
    out: StateNumbers,
) -> None:
    """Copy what of a state is told, but for the information, which is its update's own.

    Args:
        pose: The state.
        P: Its covariance.
        parents: Of its links, (links,); −1 of the root.
        glide: What its pose still glides by.
        scale: See :func:`published_variance`.
        out: Filled.
    """
    out.scale[0] = scale
    for axis in range(3):
        out.position[axis], out.velocity[axis] = pose.position[axis], pose.velocity[axis]
        out.shift[axis], out.place_variance[axis] = glide.shift[axis], P[axis, axis]
    for link in range(len(parents)):
        own, above = 3 + 3 * link, 3 + 3 * parents[link]
        for a in range(3):
            out.rates[link, a], out.turns[link, a] = pose.rates[link, a], glide.turns[link, a]
            for b in range(3):
                out.rotations[link, a, b] = pose.rotations[link, a, b]
                relative = P[own + a, own + b]
                if parents[link] >= 0:
                    relative += P[above + a, above + b]
                    relative -= P[own + a, above + b] + P[above + a, own + b]
                out.covariance[link, a, b] = relative


@compiled
def tell(
    body: BodyAsTold,
    states: StateNumbers,
    tracking_state: NDArray[np.uint8],
    rates: FloatArray,
    previous: FloatArray,
    told: Told,
) -> None:
    """All that is told of n states of one body, one after the other.

    Args:
        body: Whose.
        states: A row each.
        tracking_state: (n, s, joints).
        rates: Of the degrees of freedom, (d,), by which they may be late; of no rows: their own.
        previous: The degrees of freedom before, (d,); become the last ones.
        told: Filled.
    """
    of_dof = np.empty((5, len(previous)))
    rotations = np.empty(states.rotations.shape[1:])
    for n in range(len(states.position)):
        state = StateNumbers(
            states.position[n],
            states.velocity[n],
            states.rotations[n],
            states.rates[n],
            states.turns[n],
            states.shift[n],
            states.place_variance[n],
            states.covariance[n],
            states.information[n],
            states.scale[n],
        )
        read(body, state, rates, previous, rotations, of_dof, told.source[n])
        told.position[n], told.velocity[n], told.variance[n] = of_dof[0], of_dof[1], of_dof[2]
        told.weight_kinect[n], told.weight_imu[n] = of_dof[3], of_dof[4]
        place_links(
            body.numbers,
            np.eye(3),
            previous.reshape((1, -1)),
            rotations.reshape((1, len(rotations), 3, 3)),
            told.joints[n : n + 1],
        )
        place_origins(
            previous, rotations, told.joints[n], body.numbers.turns_about, told.T_map_link[n]
        )
        share_cameras(tracking_state[n], told.sensor_weight[n])


@compiled
def read(
    body: BodyAsTold,
    state: StateNumbers,
    rates: FloatArray,
    previous: FloatArray,
    rotations: FloatArray,
    out: FloatArray,
    source: NDArray[np.uint8],
) -> None:
    """One state's degrees of freedom; limbs are turned about themselves as their hinges show.

    Args:
        body: Whose.
        state: The state.
        rates: See :func:`tell`.
        previous: The degrees of freedom before, (d,); become the present ones.
        rotations: Filled, (links, 3, 3): as they go out.
        out: Filled, (5, d): values, rates, variances, the Kinects' and the IMUs' shares.
        source: Filled, (d,).
    """
    position, glide = state.position.copy(), Glide(state.turns, state.shift)
    if is_over(glide):
        rotations[:] = state.rotations
    else:
        turn_all(glide.turns, 1.0, state.rotations, rotations)
        position += glide.shift
    turn_into_hinge_planes(rotations, body.hinges)
    read_pose(body.numbers, position, rotations, state, previous, out)
    share_out(out[3:], NOTHING, out[3:], source)
    moving = rates if len(rates) > 0 else out[1]
    published_variance(out[2], moving, out[4], state.scale[0], body.trusts, out[2])
    previous[:] = out[0]


@compiled_in_place
def share_out(
    information: FloatArray, least: float, share: FloatArray, source: NDArray[np.uint8]
) -> None:
    """Each source's share of what an update knew, and the name for it.

    Args:
        information: Of Kinects and of IMUs, (2, d).
        least: Information that counts.
        share: Filled, (2, d) [-]; may be the information itself.
        source: Filled, (d,): 1 Kinects, 2 IMUs, 3 both, 0 neither, as in ``estimates.Source``.
    """
    for at in range(len(source)):
        kinects, imus = information[0, at], information[1, at]
        total = kinects + imus
        share[0, at] = kinects / total if total > least else 0.0
        share[1, at] = imus / total if total > least else 0.0
        source[at] = (1 if kinects > least else 0) + (2 if imus > least else 0)


@compiled_in_place
def published_variance(
    variance: FloatArray,
    velocity: FloatArray,
    weight_imu: FloatArray,
    scale: float,
    trusts: FloatArray,
    out: FloatArray,
) -> None:
    """Variances that errors keep to; see :mod:`pose_core.estimators.uncertainty`.

    Args:
        variance: The filter's, (d,).
        velocity: (d,).
        weight_imu: Share of the IMUs, (d,) [-].
        scale: Of the variances [-].
        trusts: Factor [-], lateness [s] and deviation, by Kinects alone and with an IMU, (2, 3, d).
        out: Filled, (d,); may be the filter's.
    """
    for at in range(len(out)):
        which = 1 if weight_imu[at] > 0.0 else 0
        factor, late_s, stddev = trusts[which, 0, at], trusts[which, 1, at], trusts[which, 2, at]
        moved = late_s * velocity[at]
        out[at] = factor * scale * variance[at] + moved**2 + stddev**2
