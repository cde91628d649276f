r"""The published part of a recording's states at instants between two updates.

A live output is predicted from the last update (:mod:`pose_core.filter.published`). In a recording
the next one is known: with s the share of the interval T, positions, slides and rates are linear,
and a link is rotated by the part :math:`s\,\theta` of its rotation vector :math:`\theta` over T. A
link with an IMU, whose rates are measured, follows the cubic

.. math:: \theta(s) = (s^3 - 2 s^2 + s)\,T\omega_0 + (3 s^2 - 2 s^3)\,\theta
          + (s^3 - s^2)\,T(\omega_1 - \tfrac12\,\theta \times \omega_1)

The covariance is that after the second update.
"""

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.filter.constants import FilterConstants
from pose_core.filter.published import PUBLISHED_SLIDE, fill_relative_covariance
from pose_core.filter.state import FilterState, Pose, views_apart_variance
from pose_core.kernels.compiling import compiled, compiled_in_place
from pose_core.kernels.joint_kinematics import compute_joints
from pose_core.kernels.published_state import PublishedState
from pose_core.kernels.rotations import logarithm, product_transposed, rotate_left


@compiled
def interpolate_published(
    constants: FilterConstants,
    before: Pose,
    state: FilterState,
    interval_s: float,
    shares: FloatArray,
    out: PublishedState,
) -> None:
    """Compute the published part at n instants between two states.

    Args:
        constants: The filter's constants.
        before: The pose after the first update.
        state: The state after the second.
        interval_s: Time between them [s].
        shares: Of this time that has passed at the instants, (n,), 0 to 1.
        out: n rows, filled, except information and scale.
    """
    after, body, count = state.pose, constants.camera.body, state.layout.links
    turns, apart, still_s = np.empty((count, 3)), np.empty((3, 3)), np.zeros(count)
    covariance = np.empty((count, 3, 3))
    for link in range(count):
        product_transposed(after.rotations[link], before.rotations[link], apart)
        logarithm(apart, turns[link])
        fill_relative_covariance(constants, state, 0.0, still_s, link, covariance[link])
    levers, turn = np.zeros((out.joints.shape[1], count, 3)), np.empty(3)
    for row in range(len(shares)):
        s = shares[row]
        position, rotations, joints = out.position[row], out.rotations[row], out.joints[row]
        position[:] = (1.0 - s) * before.position + s * after.position
        out.velocity[row] = (1.0 - s) * before.velocity + s * after.velocity
        out.rates[row] = (1.0 - s) * before.rates + s * after.rates
        slides = PUBLISHED_SLIDE * ((1.0 - s) * before.slides + s * after.slides)
        rotations[:] = before.rotations
        for link in range(count):
            turn[:] = s * turns[link]
            if state.imus.is_used[link]:
                hermite_rotation_vector(
                    before.rates[link], after.rates[link], turns[link], interval_s, s, turn
                )
            rotate_left(turn[0], turn[1], turn[2], rotations[link])
        compute_joints(body, position, rotations, slides, levers, joints)
        out.covariance[row] = covariance
        for axis in range(3):
            out.position_variance[row, axis] = state.P[axis, axis] + views_apart_variance(
                state, axis
            )


@compiled_in_place
def hermite_rotation_vector(
    first: FloatArray,
    second: FloatArray,
    whole: FloatArray,
    interval_s: float,
    s: float,
    out: FloatArray,
) -> None:
    """Part of a rotation vector by the cubic through its rates, (3,) each [rad/s] and [rad]."""
    start, end = interval_s * (s**3 - 2.0 * s**2 + s), interval_s * (s**3 - s**2)
    for a, b, c in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        turned = second[a] - 0.5 * (whole[b] * second[c] - whole[c] * second[b])
        out[a] = start * first[a] + (3.0 * s**2 - 2.0 * s**3) * whole[a] + end * turned
