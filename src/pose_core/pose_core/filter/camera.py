r"""Measurement model of a camera's joints.

A frame of camera c measures the position of joint j, with the view's slowly varying offset b:

.. math:: z_{cj} = p_j + R_z(\mathrm{heading})\,b_{cj} + d_{cj} + n, \quad
          p_j = p + \sum_l R_l\,(o_{jl} + s_{jl})

The rotations are linearised with sigma points (``sigma_points``); everything else is linear. d is
the error along the ray (``depth_errors``). The noise n is learnt from the views' differences
(``view_noise``), and larger for inferred joints and under self-occlusion (``occlusion``). b
contains an offset that all views share (``shared_offsets``); that of a limb's far joint is in the
state, if the limb wears an IMU.
"""

from typing import NamedTuple

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.filter.depth_errors import add_depth_error
from pose_core.filter.frame import CameraFrame, PredictedView, is_measured
from pose_core.filter.occlusion import Capsules, fill_occlusion
from pose_core.filter.rows import Rows, add_group
from pose_core.filter.sigma_points import linearise_joint
from pose_core.filter.state import NO_COLUMN, FilterState, another_camera_sends
from pose_core.filter.view_noise import noise_scale
from pose_core.joints import TrackingState
from pose_core.kernels.compiling import compiled_in_place, compiled_into_caller
from pose_core.kernels.joint_kinematics import (
    BodyArrays,
    compute_joint_velocities,
    compute_joints,
    joint_jacobian,
)


class CameraConstants(NamedTuple):
    """Parameters of :class:`pose_core.filter.tuning.CameraNoise`, and the observed body."""

    body: BodyArrays
    capsules: Capsules
    variance: float  # [m²]
    inferred_variance: float  # [m²]
    occluded_variance: float  # [m²]
    student_dof: float


@compiled_into_caller
def predict_view(
    constants: CameraConstants, state: FilterState, frame: CameraFrame
) -> PredictedView:
    """Predict the joints that a frame measures, and their self-occlusion."""
    pose, joints, links = state.pose, len(frame.positions), state.layout.links
    levers, positions = np.zeros((joints, links, 3)), np.empty((joints, 3))
    compute_joints(constants.body, pose.position, pose.rotations, pose.slides, levers, positions)
    velocity, occlusion = np.empty((joints, 3)), np.empty(joints)
    compute_joint_velocities(constants.body, levers, pose.velocity, pose.rates, velocity)
    fill_occlusion(constants.capsules, positions, frame.camera, occlusion)
    return PredictedView(positions, levers, velocity, pose.rotations.copy(), occlusion)


@compiled_into_caller
def add_camera_rows(
    constants: CameraConstants,
    state: FilterState,
    frame: CameraFrame,
    view: PredictedView,
    rows: Rows,
) -> None:
    """Add the measurement rows of all joints in a frame."""
    layout = state.layout
    c, s = heading_cosine_sine(view.rotations[0])
    shift = np.empty(3)
    for joint in range(len(frame.positions)):
        if not is_measured(frame, joint):
            continue
        group = add_group(rows, 3, constants.student_dof, joint)
        first = rows.first[group]
        H, residual = rows.H[first : first + 3], rows.residual[first : first + 3]
        joint_jacobian(constants.body, joint, view.rotations, layout.first_slide, H)
        has_other = has_other_source(constants.body, state, frame.sensor, joint)
        occlusion = view.occlusion[joint] if has_other else 0.0
        variance = joint_variance(constants, state, frame, joint, occlusion)
        variance += state.views.offset_variance[frame.sensor, joint]
        for axis in range(3):
            rows.noise[group, axis, axis] = variance
        linearise_joint(constants.body, joint, view.levers, state.P, H, shift, rows.noise[group])
        joint_residual(state, frame, joint, view.positions[joint] + shift, c, s, residual)
        column = state.shared.column[joint]
        if column != NO_COLUMN:
            H[0, column], H[0, column + 1] = c, -s
            H[1, column], H[1, column + 1] = s, c
            H[2, column + 2] = 1.0
        add_depth_error(state, frame.sensor, view.positions[joint], frame.camera, rows)


@compiled_in_place
def joint_residual(
    state: FilterState,
    frame: CameraFrame,
    joint: int,
    predicted: FloatArray,
    cosine: float,
    sine: float,
    out: FloatArray,
) -> None:
    """Measured minus predicted position of a joint [m].

    ``cosine`` and ``sine`` are those of the root's heading.
    """
    own, shared = state.views.offset[frame.sensor, joint], state.shared.offset[joint]
    x, y, z = own[0] + shared[0], own[1] + shared[1], own[2] + shared[2]
    out[0] = frame.positions[joint, 0] - predicted[0] - (cosine * x - sine * y)
    out[1] = frame.positions[joint, 1] - predicted[1] - (sine * x + cosine * y)
    out[2] = frame.positions[joint, 2] - predicted[2] - z


@compiled_in_place
def has_other_source(body: BodyArrays, state: FilterState, sensor: int, joint: int) -> bool:
    """Whether another camera sends frames, or an IMU is on the joint's link.

    Without either, the tracker's guess of a joint that the body hides is the best there is.
    """
    if another_camera_sends(state, sensor):
        return True
    link = body.carriers[joint, body.carrier_count[joint] - 1]
    return bool(state.imus.is_used[link])


@compiled_in_place
def heading_cosine_sine(R_map_root: FloatArray) -> tuple[float, float]:
    """Cosine and sine of the root's heading."""
    x, y = R_map_root[0, 0], R_map_root[1, 0]
    length = max(np.sqrt(x * x + y * y), 1e-9)
    return x / length, y / length


@compiled_in_place
def joint_variance(
    constants: CameraConstants, state: FilterState, frame: CameraFrame, joint: int, occlusion: float
) -> float:
    """Variance of a joint's measurement in each direction [m²]."""
    variance = noise_scale(state) * constants.variance + constants.occluded_variance * occlusion**2
    if frame.tracking_state[joint] == TrackingState.INFERRED:
        variance += constants.inferred_variance
    return variance
