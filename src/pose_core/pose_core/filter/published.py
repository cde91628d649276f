r"""The published part of a filter state, at its own instant or at a later one.

To a later instant, rotations are predicted by their rates, and the position by its velocity, which
stays for longer than a camera is late. Links with an aligned IMU turn as it does instead: between
two samples, with :math:`A = R_z(\psi)\,R_{ws}`,

.. math:: \omega(t_2) = \omega(t_1) + A_2\,\omega_{s,2} - A_1\,\omega_{s,1}, \quad
          R(t_2) = A_2\,A_1^T\,R(t_1)

and their covariance does not grow. The time ahead is that of a camera's latency and its tracker's
delay, often a tenth of a second, in which a limb's rate changes too much for two samples of the
gyroscope. Only the blocks of the covariance that are published are computed.

Joints are published with a part of their slides only: besides what joints really move within their
links, slides take in the trackers' slow offsets.
"""

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.filter.constants import FilterConstants
from pose_core.filter.imu import ImuFrame
from pose_core.filter.layout import rotation_column
from pose_core.filter.motion import predict_mean, rate_decay
from pose_core.filter.state import FilterState, Pose, views_apart_variance
from pose_core.kernels.compiling import compiled, compiled_in_place, compiled_into_caller
from pose_core.kernels.joint_kinematics import compute_joints
from pose_core.kernels.published_state import PublishedState
from pose_core.kernels.rotations import exponential, product, product_transposed

PUBLISHED_SLIDE = 0.6  # [-] of a slide
MAX_STEADY_S = 0.2  # [s] for which the root is predicted to keep its velocity


@compiled
def predict_published(
    constants: FilterConstants,
    state: FilterState,
    dt_s: float,
    before: ImuFrame,
    imus: ImuFrame,
    out: PublishedState,
) -> None:
    """Compute the published part of a state advanced by ``dt_s`` [s]; the state does not change.

    Args:
        constants: The filter's constants.
        state: The state.
        dt_s: Time since the state's instant [s].
        before: Samples of the aligned IMUs at the state's instant.
        imus: The same at the later instant.
        out: Filled, except information and scale.
    """
    out.ahead_s[0] = dt_s
    motion, body, links = constants.motion, constants.camera.body, state.layout.links
    pose = Pose(
        out.position, out.rotations, PUBLISHED_SLIDE * state.pose.slides, out.velocity, out.rates
    )
    pose.position[:], pose.velocity[:] = state.pose.position, state.pose.velocity
    pose.rotations[:], pose.rates[:] = state.pose.rotations, state.pose.rates
    keep, rate_time_s = rate_decay(motion.rate_memory_s, dt_s)
    predict_mean(pose, keep, rate_time_s, np.exp(-dt_s / motion.slide_memory_s))
    steady_s = min(dt_s, MAX_STEADY_S)
    pose.position[:] = state.pose.position + steady_s * state.pose.velocity
    rate_times_s = np.full(links, rate_time_s)
    rotate_with_imus(state, before, imus, pose, rate_times_s)
    levers = np.zeros((len(out.joints), links, 3))
    compute_joints(body, pose.position, pose.rotations, pose.slides, levers, out.joints)
    first_rate = state.layout.first_rate
    for axis in range(3):
        out.position_variance[axis] = (
            later_covariance(state.P, first_rate, axis, axis, dt_s, dt_s)
            + dt_s**3 / 3.0 * motion.root_power
            + views_apart_variance(state, axis)
        )
    for link in range(links):
        fill_relative_covariance(constants, state, dt_s, rate_times_s, link, out.covariance[link])


@compiled_into_caller
def rotate_with_imus(
    state: FilterState, before: ImuFrame, imus: ImuFrame, pose: Pose, rate_times_s: FloatArray
) -> None:
    """Rotate the links whose IMU has samples at both instants as it has turned between them.

    Args:
        state: The state.
        before: Samples at its instant.
        imus: Samples at the later instant.
        pose: The pose at the later instant; rotations and rates of these links are replaced.
        rate_times_s: Set to 0 for these links, (links,) [s].
    """
    R_z, R_map_sensor = np.empty((3, 3)), np.empty((3, 3))
    R_earlier, turned = np.empty((3, 3)), np.empty((3, 3))
    for row in range(len(imus.links)):
        link = imus.links[row]
        for earlier in range(len(before.links)):
            if before.links[earlier] != link:
                continue
            exponential(0.0, 0.0, state.imus.heading[link], R_z)
            product(R_z, imus.R_world_sensor[row], R_map_sensor)
            change = np.dot(R_map_sensor, imus.angular_velocity[row])
            product(R_z, before.R_world_sensor[earlier], R_earlier)
            change -= np.dot(R_earlier, before.angular_velocity[earlier])
            pose.rates[link] = state.pose.rates[link] + change
            product_transposed(R_map_sensor, R_earlier, turned)
            product(turned, state.pose.rotations[link], pose.rotations[link])
            rate_times_s[link] = 0.0


@compiled_in_place
def later_covariance(
    P: FloatArray, first_rate: int, i: int, k: int, first_s: float, second_s: float
) -> float:
    """An element of F P Fᵀ: the covariance of two error states moved by their rates.

    Args:
        P: Covariance, (n, n).
        first_rate: Column of the first rate; rates are in the order of position and rotations.
        i: Row of the first error state.
        k: Row of the second.
        first_s: Time for which the rate of the first moves it [s].
        second_s: The same of the second.
    """
    moved = P[i, k] + first_s * P[first_rate + i, k] + second_s * P[i, first_rate + k]
    return moved + first_s * second_s * P[first_rate + i, first_rate + k]


@compiled_in_place
def fill_relative_covariance(
    constants: FilterConstants,
    state: FilterState,
    dt_s: float,
    rate_times_s: FloatArray,
    link: int,
    out: FloatArray,
) -> None:
    """Fill the covariance of a link's rotation relative to its parent's, (3, 3) [rad²].

    Args:
        constants: The filter's constants.
        state: The state before ``dt_s``.
        dt_s: Time since then [s].
        rate_times_s: Time for which its rate moves each link, (links,) [s]; 0 if an IMU does.
        link: The link.
        out: Filled.
    """
    P, rates, power = state.P, state.layout.first_rate, constants.motion.power
    parent = constants.camera.body.parents[link]
    own, above, own_s = rotation_column(link), rotation_column(parent), rate_times_s[link]
    for a in range(3):
        for b in range(3):
            relative = later_covariance(P, rates, own + a, own + b, own_s, own_s)
            if parent >= 0:
                above_s = rate_times_s[parent]
                relative += later_covariance(P, rates, above + a, above + b, above_s, above_s)
                relative -= later_covariance(P, rates, own + a, above + b, own_s, above_s)
                relative -= later_covariance(P, rates, above + a, own + b, above_s, own_s)
            out[a, b] = relative
    growth = power[link, link] if own_s > 0.0 else 0.0
    if parent >= 0 and rate_times_s[parent] > 0.0:
        growth += power[parent, parent]
        if own_s > 0.0:
            growth -= 2.0 * power[link, parent]
    for axis in range(3):
        out[axis, axis] += dt_s**3 / 3.0 * growth
