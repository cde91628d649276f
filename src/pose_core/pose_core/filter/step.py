"""The measurement updates of the default filter, with IMUs and with a camera's frame.

Order of a step: :func:`pose_core.filter.motion.predict` to the frame's time, then
:func:`update_with_imus`, then :func:`update_with_frame`.
"""

from typing import NamedTuple

import numpy as np

from pose_core.filter.adaptation import LONGEST_GAP_S, adapt, estimate_delay, estimate_offsets
from pose_core.filter.camera import CameraFrame, add_camera, predict_view
from pose_core.filter.constants import FilterConstants
from pose_core.filter.imu import ImuReadings, add_imus
from pose_core.filter.posture import add_posture, turn_back
from pose_core.filter.rows import Rows, make_rows
from pose_core.filter.shared_offsets import estimate_shared_offsets
from pose_core.filter.state import FilterState
from pose_core.filter.update import robust_update
from pose_core.kernels.compiling import compiled
from pose_core.kernels.small_matrices import add, inverse, scaled, symmetric
from pose_core.streams.samples import FloatArray

CAMERA_ITERATIONS, IMU_ITERATIONS = 2, 1
POSTURE_ROWS = 64  # at most
LARGEST_NIS = 9.0  # [-] a joint's NIS is clipped to it before averaging


class StepResult(NamedTuple):
    """Result of the update with a frame, in addition to the state."""

    is_finite: bool  # otherwise the filter has to be restarted
    turned_back: int  # limbs that were rotated by half a turn
    mean_nis: float  # [-] mean normalised innovation squared of the joints; NaN without joints
    median_nis: float  # [-] their median; NaN without joints


@compiled
def update_with_imus(
    constants: FilterConstants,
    state: FilterState,
    readings: ImuReadings,
    information: FloatArray,
) -> bool:
    """Measurement update with the aligned IMUs; returns whether the result is finite.

    Args:
        constants: The filter's constants.
        state: Prior state; becomes the posterior.
        readings: Samples of the IMUs whose alignment is in the state.
        information: (links, 3, 3) [1/rad²] on each link's rotation; the IMUs' share is added.
    """
    count = len(readings.links)
    if count == 0:
        return True
    rows = make_rows(6 * count, 2 * count, len(state.P))
    add_imus(constants.imu, state, readings, rows)
    weights, distance, spread = np.empty(2 * count), np.empty(2 * count), np.empty(6 * count)
    if not robust_update(state, rows, IMU_ITERATIONS, 1e-3, weights, distance, spread):
        return False
    for row in range(count):
        precision = scaled(inverse(symmetric(rows.noise[2 * row])), weights[2 * row])
        add(precision, information[readings.links[row]])
    return True


@compiled
def update_with_frame(
    constants: FilterConstants, state: FilterState, frame: CameraFrame, information: FloatArray
) -> StepResult:
    """Measurement update with a camera's frame and the posture prior.

    Args:
        constants: The filter's constants.
        state: Prior state; becomes the posterior.
        frame: One camera's joints.
        information: (links, 3, 3) [1/rad²] on each link's rotation; the camera's share is added.
    """
    joints = len(frame.positions)
    rows = make_rows(3 * joints + POSTURE_ROWS, joints + POSTURE_ROWS, len(state.P))
    view = predict_view(constants.camera, state, frame)
    add_camera(constants.camera, state, frame, view, rows)
    seen = rows.filled[1]
    add_posture(constants.posture, state.pose.rotations, rows)
    groups, count = rows.filled[1], rows.filled[0]
    weights, distance, spread = np.empty(groups), np.empty(groups), np.empty(count)
    if not robust_update(
        state,
        rows,
        CAMERA_ITERATIONS,
        constants.camera.least_weight,
        weights,
        distance,
        spread,
    ):
        return StepResult(False, 0, np.nan, np.nan)
    estimate_offsets(state, frame, view, rows, rows.residual[:count], spread, weights)
    if frame.late_s == 0.0:
        estimate_delay(
            constants.starts,
            constants.ends,
            constants.delay_prior,
            constants.known_delay_s,
            constants.delay_memory_s,
            state,
            frame,
            view,
            rows,
            weights,
            np.empty(joints, np.int64),
        )
    if seen > 0:
        gap_s = min(state.silent_s[frame.sensor], LONGEST_GAP_S) / len(state.silent_s)
        estimate_shared_offsets(constants.shared_offsets, view, gap_s, state)
    adapt(
        constants.ends,
        constants.most_adaptation,
        constants.adapted_distance,
        constants.adaptation_memory_s,
        state,
        frame.sensor,
        rows,
        distance,
    )
    add_link_information(rows, seen, weights, information)
    turned = turn_back(constants.posture, state, np.empty((3, 3)))
    if seen == 0:
        return StepResult(True, turned, np.nan, np.nan)
    mean_nis = np.mean(np.minimum(distance[:seen], LARGEST_NIS))
    return StepResult(True, turned, float(mean_nis), float(np.median(distance[:seen])))


@compiled
def add_link_information(rows: Rows, seen: int, weights: FloatArray, out: FloatArray) -> None:
    """Add Hᵀ (R / w)⁻¹ H of each joint to the links' diagonal blocks, with R's mean variance."""
    for group in range(seen):
        first, noise = rows.first[group], rows.noise[group]
        precision = 3.0 * weights[group] / (noise[0, 0] + noise[1, 1] + noise[2, 2])
        for link in range(len(out)):
            for i in range(3):
                for k in range(3):
                    total = 0.0
                    for row in range(first, first + 3):
                        total += rows.H[row, 3 + 3 * link + i] * rows.H[row, 3 + 3 * link + k]
                    out[link, i, k] += precision * total
