"""What goes out for a state: the gliding pose, its degrees of freedom, their uncertainty."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pose_fusion.kernels.compiling import compiled
from pose_fusion.kernels.forward import ModelNumbers, place_links
from pose_fusion.kernels.gliding import Glide, is_over
from pose_fusion.kernels.hinge_plane import Hinges, turn_into_hinge_planes
from pose_fusion.kernels.placing import Pose
from pose_fusion.kernels.reading import read_pose
from pose_fusion.kernels.rotations import turn_all
from pose_fusion.kernels.seeing import share_cameras
from pose_fusion.streams.samples import FloatArray

NOTHING = 1e-6  # [1/rad²] information that is none


class BodyAsTold(NamedTuple):
    """What one body's poses are told with."""

    numbers: ModelNumbers
    hinges: Hinges
    trusts: FloatArray  # see :func:`published_variance`


class Told(NamedTuple):
    """What is told of a pose: filled."""

    of_dof: FloatArray  # (5, d): values, rates, variances, the Kinects' and the IMUs' shares
    source: NDArray[np.uint8]  # (d,)
    rotations: FloatArray  # (links, 3, 3): of the pose that the degrees of freedom give
    joints: FloatArray  # (joints, 3) [m]: likewise
    sensor_weight: FloatArray  # (s, joints) [-]


@compiled
def tell(
    body: BodyAsTold,
    pose: Pose,
    glide: Glide,
    P: FloatArray,
    information: FloatArray,
    scale: float,
    rates: FloatArray,
    tracking_state: NDArray[np.uint8],
    previous: FloatArray,
    told: Told,
) -> None:
    """All that is told of a pose; limbs are turned about themselves as their hinges show.

    Args:
        body: Whose.
        pose: The state.
        glide: What its pose still glides by.
        P: Its covariance.
        information: Of each source on each link, (2, links, 3, 3) [1/rad²].
        scale: See :func:`published_variance`.
        rates: Of the degrees of freedom, (d,), by which it may be late; of no rows: the pose's own.
        tracking_state: (s, joints).
        previous: The degrees of freedom before, (d,); become the present ones.
        told: Filled.
    """
    position, rotations = pose.position.copy(), told.rotations
    if is_over(glide):
        rotations[:] = pose.rotations
    else:
        turn_all(glide.turns, 1.0, pose.rotations, rotations)
        position += glide.shift
    turn_into_hinge_planes(rotations, body.hinges)
    turned = Pose(position, rotations, pose.slides, pose.velocity, pose.rates)
    out = told.of_dof
    read_pose(body.numbers, turned, P, information, previous, out)
    share_out(out[3:], NOTHING, out[3:], told.source)
    moving = rates if len(rates) > 0 else out[1]
    published_variance(out[2], moving, out[4], scale, body.trusts, out[2])
    previous[:] = out[0]
    place_links(
        body.numbers,
        np.eye(3),
        previous.reshape((1, -1)),
        rotations.reshape((1, len(rotations), 3, 3)),
        told.joints.reshape((1, len(told.joints), 3)),
    )
    share_cameras(tracking_state, told.sensor_weight)


@compiled
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
    known_of = np.empty(2)
    for at in range(len(source)):
        known_of[0], known_of[1] = information[0, at], information[1, at]
        total = known_of[0] + known_of[1]
        source[at] = 0
        for which in range(2):
            known = known_of[which]
            share[which, at] = known / total if total > least else 0.0
            if known > least:
                source[at] += which + 1


@compiled
def published_variance(
    variance: FloatArray,
    velocity: FloatArray,
    weight_imu: FloatArray,
    scale: float,
    trusts: FloatArray,
    out: FloatArray,
) -> None:
    """Variances that errors keep to; see :mod:`pose_fusion.fusion.estimators.uncertainty`.

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
