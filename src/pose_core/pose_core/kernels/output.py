"""Published quantities of filter states: joint angles, rates, uncertainty, link transforms."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pose_core.arrays import FloatArray
from pose_core.kernels.axial_rotation import Hinges, rotate_into_hinge_planes
from pose_core.kernels.compiling import compiled, compiled_in_place, compiled_into_caller
from pose_core.kernels.forward_kinematics import ROOT_DOF, ModelArrays, compute_pose
from pose_core.kernels.joint_angle_extraction import continuous_vector, extract_pose
from pose_core.kernels.link_frames import compute_link_transforms
from pose_core.kernels.output_blending import (
    BLEND_OF_PREDICTION,
    BLEND_S,
    CARRIED_SPEED,
    JUMP_M,
    JUMP_S,
    REST_AFTER_S,
    UNSEEN_SPEED,
    Blending,
    advance_clock,
    advance_skeleton_clock,
    blend_angle,
    decay,
    mark_sweeping_joints_unknown,
)
from pose_core.kernels.published_state import (
    CAMERAS,
    IMUS,
    DofEstimate,
    PublishedState,
    Source,
    make_dof_estimate,
)
from pose_core.kernels.rotations import logarithm, product_transposed, rotate_left

MIN_INFORMATION = 1e-6  # [1/rad²] lower bound of the information that counts


class OutputBody(NamedTuple):
    """Constants for publishing one body's poses."""

    model: ModelArrays
    limits: FloatArray  # (d, 2) [rad] of the degrees of freedom; infinite for the root
    hinges: Hinges
    legs: NDArray[np.int64]  # degrees of freedom of hips and knees
    variance_calibration: FloatArray  # see :func:`published_variance`


class PoseOutput(NamedTuple):
    """Published quantities of n states."""

    position: FloatArray  # (n, d) [m] or [rad]
    velocity: FloatArray  # (n, d)
    variance: FloatArray  # (n, d)
    is_known: NDArray[np.bool_]  # (n, d)
    weight_kinect: FloatArray  # (n, d) [-]
    weight_imu: FloatArray  # (n, d) [-]
    source: NDArray[np.uint8]  # (n, d)
    joints: FloatArray  # (n, joints, 3) [m]: the filter's, blended
    fk_joints: FloatArray  # (n, joints, 3) [m]: from the published degrees of freedom
    T_map_link: FloatArray  # (n, links, 4, 4): likewise


@compiled
def output_states(
    body: OutputBody,
    stamps_ns: NDArray[np.int64],
    states: PublishedState,
    blending: Blending,
    output: PoseOutput,
) -> None:
    """Publish n states of one body, one after the other.

    Args:
        body: The body.
        stamps_ns: (n,) [ns].
        states: The states, n rows.
        blending: The last output; updated.
        output: Filled.
    """
    dof = make_dof_estimate(len(blending.position))
    rotations = np.empty(states.rotations.shape[1:])
    for n in range(len(states.position)):
        state = PublishedState(
            states.position[n],
            states.velocity[n],
            states.rotations[n],
            states.rates[n],
            states.joints[n],
            states.position_variance[n],
            states.covariance[n],
            states.information[n],
            states.scale[n],
            states.ahead_s[n],
        )
        rotations[:] = state.rotations
        rotate_into_hinge_planes(rotations, body.hinges)
        extract_pose(body.model, rotations, state, blending.position, dof)
        weigh_sources(
            dof.information, output.weight_kinect[n], output.weight_imu[n], output.source[n]
        )
        dt_s = advance_clock(blending, int(stamps_ns[n]))
        root_blend_s = max(BLEND_S, BLEND_OF_PREDICTION * state.ahead_s[0])
        skeleton_dt_s = advance_skeleton_clock(blending, dof, dt_s)
        blend(
            body, dt_s, skeleton_dt_s, root_blend_s, rotations[0], blending, dof, output.is_known[n]
        )
        published_variance(
            dof,
            blending.velocity,
            output.weight_imu[n],
            state.scale[0],
            body.variance_calibration,
            output.variance[n],
        )
        output.position[n], output.velocity[n] = blending.position, blending.velocity
        blend_joints(body.model, skeleton_dt_s, state, blending, output.joints[n])
        blending.stamp_ns[0] = stamps_ns[n]
        compute_pose(body.model, np.eye(3), blending.position, rotations, output.fk_joints[n])
        compute_link_transforms(
            blending.position,
            rotations,
            output.fk_joints[n],
            body.model.pivot_joints,
            output.T_map_link[n],
        )


@compiled_into_caller
def blend(
    body: OutputBody,
    dt_s: float,
    root_dt_s: float,
    root_blend_s: float,
    R_map_root: FloatArray,
    blending: Blending,
    dof: DofEstimate,
    is_known: NDArray[np.bool_],
) -> None:
    """Blend one state's degrees of freedom with the last output.

    Args:
        body: The body.
        dt_s: See :func:`advance_clock`.
        root_dt_s: See :func:`advance_skeleton_clock`.
        root_blend_s: 1/k of the root's position [s].
        R_map_root: The root's rotation, (3, 3).
        blending: The last output; updated.
        dof: The filter's estimate; the root's becomes the published one, and what blending adds
            to the variances is filled in.
        is_known: Filled, (d,).
    """
    dof.blended[:] = 0.0
    blend_root(root_dt_s, root_blend_s, R_map_root, blending, dof)
    add_unseen_motion(body, blending.unseen_s[0], dof)
    is_known[:ROOT_DOF] = True
    for at in range(ROOT_DOF, len(is_known)):
        is_known[at] = blend_angle(blending, at, dt_s, dof, body.limits[at])
    mark_sweeping_joints_unknown(body.model, body.limits, blending, dof, is_known)


@compiled_into_caller
def add_unseen_motion(body: OutputBody, unseen_s: float, dof: DofEstimate) -> None:
    """Add to the root's variances how far it may have moved since cameras have last seen it."""
    is_carried = np.all(dof.information[IMUS, body.legs] > 0.0)
    speed = CARRIED_SPEED if is_carried else UNSEEN_SPEED
    walked = speed * max(unseen_s - REST_AFTER_S, 0.0)
    for axis in range(2):
        dof.blended[axis] += walked**2
    if is_carried:
        for axis in range(3):
            dof.blended[axis] += (JUMP_M * min(unseen_s / JUMP_S, 1.0)) ** 2


@compiled_into_caller
def blend_root(
    dt_s: float, blend_s: float, R_map_root: FloatArray, blending: Blending, dof: DofEstimate
) -> None:
    """Blend the root's position and, on the manifold, its rotation; see :func:`blend`."""
    R, apart, turn = np.empty((3, 3)), np.empty((3, 3)), np.zeros(3)
    R[:] = R_map_root
    if dt_s > 0.0:
        for axis in range(3):
            v, w = dof.velocity[axis], dof.velocity[3 + axis]
            e = blending.position[axis] - (dof.position[axis] - v * dt_s)
            e, e_rate = decay(e, blending.velocity[axis] - v, blend_s, dt_s)
            dof.position[axis] += e
            dof.velocity[axis] += e_rate
            dof.blended[axis] = e**2
        w_x, w_y, w_z = dof.velocity[3], dof.velocity[4], dof.velocity[5]
        rotate_left(-dt_s * w_x, -dt_s * w_y, -dt_s * w_z, R)
        product_transposed(blending.R_map_root, R, apart)
        logarithm(apart, turn)
        for axis in range(3):
            w = dof.velocity[3 + axis]
            rate = blending.velocity[3 + axis] - w
            turn[axis], e_rate = decay(turn[axis], rate, BLEND_S, dt_s)
            dof.velocity[3 + axis] += e_rate
            dof.blended[3 + axis] = turn[axis] ** 2
        R[:] = R_map_root
        rotate_left(turn[0], turn[1], turn[2], R)
        logarithm(R, turn)
        continuous_vector(turn, blending.position[3:6], dof.position[3:6])
    blending.R_map_root[:] = R
    for at in range(ROOT_DOF):
        blending.position[at], blending.velocity[at] = dof.position[at], dof.velocity[at]


@compiled_into_caller
def blend_joints(
    model: ModelArrays, dt_s: float, state: PublishedState, blending: Blending, joints: FloatArray
) -> None:
    """Blend the joints, relative to the root as published.

    Args:
        model: The body model.
        dt_s: See :func:`advance_clock`.
        state: The filter's state.
        blending: The last output; its joints are updated.
        joints: Filled, (joints, 3) [m] in map.
    """
    turn, velocity = np.empty((3, 3)), np.empty(joints.shape)
    product_transposed(blending.R_map_root, state.rotations[0], turn)
    relative_velocities(model, state, velocity)
    for joint in range(len(joints)):
        x = state.joints[joint, 0] - state.position[0]
        y = state.joints[joint, 1] - state.position[1]
        z = state.joints[joint, 2] - state.position[2]
        for axis in range(3):
            place = turn[axis, 0] * x + turn[axis, 1] * y + turn[axis, 2] * z
            v = velocity[joint, axis]
            if dt_s > 0.0:
                e = blending.joints[joint, axis] - (place - v * dt_s)
                e_rate = blending.joint_velocity[joint, axis] - v
                e, e_rate = decay(e, e_rate, BLEND_S, dt_s)
                place, v = place + e, v + e_rate
            blending.joints[joint, axis], blending.joint_velocity[joint, axis] = place, v
            joints[joint, axis] = blending.position[axis] + place


@compiled_in_place
def relative_velocities(model: ModelArrays, state: PublishedState, out: FloatArray) -> None:
    """Velocities of the joints relative to the root [m/s], (joints, 3): ω × r, link by link."""
    for link in range(len(model.parents)):
        pivot, w = model.pivot_joints[link], state.rates[link]
        start = state.position if pivot < 0 else state.joints[pivot]
        for joint in range(len(out)):
            if model.link_of_joint[joint] != link:
                continue
            x = state.joints[joint, 0] - start[0]
            y = state.joints[joint, 1] - start[1]
            z = state.joints[joint, 2] - start[2]
            out[joint, 0] = w[1] * z - w[2] * y
            out[joint, 1] = w[2] * x - w[0] * z
            out[joint, 2] = w[0] * y - w[1] * x
            if pivot >= 0:
                for axis in range(3):
                    out[joint, axis] += out[pivot, axis]


@compiled_in_place
def weigh_sources(
    information: FloatArray,
    weight_kinect: FloatArray,
    weight_imu: FloatArray,
    source: NDArray[np.uint8],
) -> None:
    """Weight of each source in an update's information, and the resulting source.

    Args:
        information: Information of Kinects and of IMUs, (2, d).
        weight_kinect: Filled, (d,) [-].
        weight_imu: Filled, (d,) [-].
        source: Filled, (d,): see :class:`~pose_core.kernels.published_state.Source`.
    """
    for at in range(len(source)):
        kinects, imus = information[CAMERAS, at], information[IMUS, at]
        total = kinects + imus
        weight_kinect[at] = kinects / total if total > MIN_INFORMATION else 0.0
        weight_imu[at] = imus / total if total > MIN_INFORMATION else 0.0
        seen = Source.KINECT if kinects > MIN_INFORMATION else Source.PREDICTED
        source[at] = seen + Source.IMU if imus > MIN_INFORMATION else seen


@compiled_in_place
def published_variance(
    dof: DofEstimate,
    velocity: FloatArray,
    weight_imu: FloatArray,
    scale: float,
    calibration: FloatArray,
    out: FloatArray,
) -> None:
    """Calibrated variances; see :mod:`pose_core.estimators.uncertainty`.

    Args:
        dof: The filter's estimate.
        velocity: The published one, (d,) [m/s] or [rad/s].
        weight_imu: Share of the IMUs, (d,) [-].
        scale: Of the variances [-].
        calibration: Coefficients f [-], T [s] and s [m] or [rad], without and with an IMU,
            (2, 3, d).
        out: Filled, (d,) [m²] or [rad²].
    """
    for at in range(len(out)):
        which = 1 if weight_imu[at] > 0.0 else 0
        factor, late_s, stddev = calibration[which, :, at]
        moved = late_s * velocity[at]
        out[at] = factor * scale * dof.variance[at] + moved**2 + stddev**2 + dof.blended[at]
