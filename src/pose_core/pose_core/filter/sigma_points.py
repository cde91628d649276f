r"""Sigma points on the manifold: the unscented form of the default filter's step.

The points are :math:`\hat x \boxplus \pm\sqrt{c}\,L_i` with :math:`P = L L^T`, where ⊞ adds an
error to the mean (:func:`pose_core.filter.state.inject_error`, by the rotations' exponential map).
The prediction is their weighted mean and covariance. A measurement becomes, by the points'
residuals :math:`r_i`, the linear one that fits them best,

.. math:: \bar r = \sum_i w^m_i r_i, \quad H = -P_{xr}^T P^{-1}, \quad
          \Omega = \sum_i w^c_i (r_i - \bar r)(r_i - \bar r)^T - H P H^T

with Ω of each group added to its noise: the unscented update, written so that the robust one of
:mod:`pose_core.filter.update` can do it. The posture prior's rows stay linearised.

References:
    Hertzberg, Wagner, Frese, Schröder (2013), Integrating generic sensor fusion algorithms with
    sound state representations through encapsulation of manifolds, Information Fusion 14(1).
    Lefebvre, Bruyninckx, De Schutter (2002), Comment on "A new method for the nonlinear
    transformation of means and covariances", IEEE TAC 47(8): the unscented filter as a statistical
    linear regression.
"""

from typing import NamedTuple

import numpy as np

from pose_core.filter.camera import (
    CameraConstants,
    CameraFrame,
    View,
    add_camera,
    heading_of,
    joint_residual,
    predict_view,
)
from pose_core.filter.constants import FilterConstants
from pose_core.filter.imu import ImuReadings, add_imus, imu_residual
from pose_core.filter.motion import (
    MotionConstants,
    acceleration_power,
    finish_prediction,
    predict_mean,
)
from pose_core.filter.rows import Rows, make_rows
from pose_core.filter.state import FilterState, copy_pose, inject_error
from pose_core.filter.step import POSTURE_ROWS, StepResult, finish_frame_update, finish_imu_update
from pose_core.kernels.cholesky import factorise
from pose_core.kernels.compiling import compiled
from pose_core.kernels.joint_kinematics import compute_joints
from pose_core.kernels.rotations import logarithm, product_transposed, turn_all
from pose_core.streams.samples import FloatArray


class SigmaWeights(NamedTuple):
    """Weights of 2 n + 1 points, and how far they lie."""

    centre_mean: float  # [-]
    centre_covariance: float  # [-]
    other: float  # [-] of every other point, in mean and covariance alike
    spread: float  # [-] c: squared distance in units of the covariance


class Scratch(NamedTuple):
    """Room for two states beside the filter's."""

    point: FilterState
    centre: FilterState


@compiled
def predict_by_points(
    constants: MotionConstants,
    state: FilterState,
    scratch: Scratch,
    weights: SigmaWeights,
    dt_s: float,
) -> None:
    """Advance the state by ``dt_s`` [s], in place."""
    keep = np.exp(-dt_s / constants.rate_memory_s)
    reach_s = constants.rate_memory_s * (1.0 - keep)
    keep_slide = np.exp(-dt_s / constants.slide_memory_s)
    power, factor = acceleration_power(constants, state), spread_factor(state.P, weights)
    errors, point, centre = np.empty((2 * len(factor), len(factor))), scratch.point, scratch.centre
    copy_pose(state.pose, centre.pose)
    predict_mean(centre, keep, reach_s, keep_slide)
    for index in range(len(errors)):
        place_point(state, factor, index, point)
        predict_mean(point, keep, reach_s, keep_slide)
        pose_error(point, centre, errors[index])
        sign = 1.0 if index % 2 == 0 else -1.0
        pose_size = 6 + 6 * len(state.heading) + 3 * len(state.pose.slides)
        errors[index, pose_size:] = sign * factor[index // 2, pose_size:]
    mean = weights.other * errors.sum(axis=0)
    errors -= mean
    state.P[:] = weights.other * np.dot(errors.T, errors)
    state.P[:] += weights.centre_covariance * np.outer(mean, mean)
    copy_pose(centre.pose, state.pose)
    inject_error(state, mean)
    finish_prediction(constants, state, power, dt_s)


@compiled
def update_with_imus_by_points(
    constants: FilterConstants,
    state: FilterState,
    scratch: Scratch,
    weights: SigmaWeights,
    readings: ImuReadings,
    information: FloatArray,
) -> bool:
    """:func:`pose_core.filter.step.update_with_imus` by sigma points."""
    count = len(readings.links)
    if count == 0:
        return True
    rows = make_rows(6 * count, 2 * count, len(state.P))
    add_imus(constants.imu, state, readings, rows)
    factor, Q = spread_factor(state.P, weights), np.empty((3, 3))
    residuals = np.empty((2 * len(factor), 6 * count))
    for index in range(len(residuals)):
        place_point(state, factor, index, scratch.point)
        for row in range(count):
            out = residuals[index, 6 * row : 6 * row + 6]
            imu_residual(scratch.point, readings, row, Q, out)
    linearise(residuals, factor, weights, rows)
    return finish_imu_update(state, readings, rows, information)


@compiled
def update_with_frame_by_points(
    constants: FilterConstants,
    state: FilterState,
    scratch: Scratch,
    weights: SigmaWeights,
    frame: CameraFrame,
    information: FloatArray,
) -> StepResult:
    """:func:`pose_core.filter.step.update_with_frame` by sigma points."""
    rows = make_rows(
        3 * len(frame.positions) + POSTURE_ROWS, len(frame.positions) + POSTURE_ROWS, len(state.P)
    )
    view = predict_view(constants.camera, state, frame)
    add_camera(constants.camera, state, frame, view, rows)
    factor = spread_factor(state.P, weights)
    residuals = np.empty((2 * len(factor), rows.filled[0]))
    for index in range(len(residuals)):
        place_point(state, factor, index, scratch.point)
        camera_residuals(constants.camera, scratch.point, frame, view, rows, residuals[index])
    linearise(residuals, factor, weights, rows)
    return finish_frame_update(constants, state, frame, view, rows, information)


@compiled
def spread_factor(P: FloatArray, weights: SigmaWeights) -> FloatArray:
    """Rows √c Lᵢ, (n, n), the errors of the points."""
    factor = weights.spread * P
    factorise(factor)
    for i in range(len(factor)):
        factor[i, :i] = 0.0
    return factor


@compiled
def place_point(state: FilterState, factor: FloatArray, index: int, out: FilterState) -> None:
    """One point: even indices are the positive ones; the delays and offsets stay the state's."""
    copy_pose(state.pose, out.pose)
    out.R_sensor_link[:] = state.R_sensor_link
    out.heading[:] = state.heading
    out.imu_column[:] = state.imu_column
    out.delay[:] = state.delay
    out.offset[:] = state.offset
    sign = 1.0 if index % 2 == 0 else -1.0
    inject_error(out, sign * factor[index // 2])


@compiled
def pose_error(state: FilterState, centre: FilterState, out: FloatArray) -> None:
    """The error, (n,), that leads from one state's pose to another's; its other columns stay."""
    pose, start, apart = state.pose, centre.pose, np.empty((3, 3))
    links, slides = len(pose.rotations), len(pose.slides)
    velocity = 3 + 3 * links + 3 * slides
    out[:3] = pose.position - start.position
    for link in range(links):
        product_transposed(pose.rotations[link], start.rotations[link], apart)
        logarithm(apart, out[3 + 3 * link : 6 + 3 * link])
    for slide in range(slides):
        at = 3 + 3 * links + 3 * slide
        out[at : at + 3] = pose.slides[slide] - start.slides[slide]
    out[velocity : velocity + 3] = pose.velocity - start.velocity
    for link in range(links):
        at = velocity + 3 + 3 * link
        out[at : at + 3] = pose.rates[link] - start.rates[link]


@compiled
def camera_residuals(
    constants: CameraConstants,
    point: FilterState,
    frame: CameraFrame,
    view: View,
    rows: Rows,
    out: FloatArray,
) -> None:
    """Residuals of the rows' joints as seen from one point, (rows,) [m]."""
    pose = point.pose
    rotations = np.empty_like(pose.rotations)
    turn_all(pose.rates, -view.tau_s, pose.rotations, rotations)
    position = pose.position - view.tau_s * pose.velocity
    levers, places = np.zeros_like(view.levers), np.empty_like(view.places)
    compute_joints(constants.body, position, rotations, pose.slides, levers, places)
    cosine, sine = heading_of(rotations[0])
    for group in range(rows.filled[1]):
        joint, first = rows.source[group], rows.first[group]
        residual = out[first : first + 3]
        joint_residual(point, frame, joint, places[joint], cosine, sine, residual)


@compiled
def linearise(residuals: FloatArray, factor: FloatArray, weights: SigmaWeights, rows: Rows) -> None:
    """Put the linear measurement that fits the points best into the rows.

    Args:
        residuals: At the points but the centre, whose residuals the rows hold, (2 n, rows).
        factor: The points' errors, (n, n).
        weights: Of the points.
        rows: Filled with n columns; derivatives, residuals and noise are replaced.
    """
    count = rows.filled[0]
    centre = rows.residual[:count].copy()
    slopes = 0.5 * (residuals[0::2] - residuals[1::2])  # (n, rows): −H √c Lᵢ
    mean = weights.centre_mean * centre + weights.other * residuals.sum(axis=0)
    for row in range(count):
        rows.H[row] = -solve_upper(factor, slopes[:, row])
        rows.residual[row] = mean[row]
    for group in range(rows.filled[1]):
        first, size = rows.first[group], rows.size[group]
        for i in range(size):
            for k in range(size):
                a, b = first + i, first + k
                total = weights.centre_covariance * (centre[a] - mean[a]) * (centre[b] - mean[b])
                for index in range(len(residuals)):
                    apart = (residuals[index, a] - mean[a]) * (residuals[index, b] - mean[b])
                    total += weights.other * apart
                for index in range(len(slopes)):
                    total -= slopes[index, a] * slopes[index, b] / weights.spread
                rows.noise[group, i, k] += total


@compiled
def solve_upper(U: FloatArray, b: FloatArray) -> FloatArray:
    """U⁻¹ b of an upper triangle."""
    x = b.copy()
    for i in range(len(U) - 1, -1, -1):
        for k in range(i + 1, len(U)):
            x[i] -= U[i, k] * x[k]
        x[i] /= U[i, i]
    return x
