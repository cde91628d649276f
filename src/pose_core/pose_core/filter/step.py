"""The measurement updates of the default filter, with IMUs and with a camera's frame.

Order of a step: :func:`pose_core.filter.motion.predict` to the frame's time, then
:func:`update_with_imus`, then :func:`update_with_frame`.
"""

from typing import NamedTuple

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.filter.camera import add_camera_rows, predict_view
from pose_core.filter.constants import FilterConstants
from pose_core.filter.frame import CameraFrame, FrameUpdate
from pose_core.filter.imu import ImuFrame, add_imu_rows
from pose_core.filter.layout import rotation_column
from pose_core.filter.posture import add_posture_rows, most_posture_rows, undo_half_turns
from pose_core.filter.rows import make_rows
from pose_core.filter.shared_offsets import estimate_shared_offsets
from pose_core.filter.standing_foot import add_standing_foot_rows, note_foot_height
from pose_core.filter.state import CAMERA_TIMEOUT_S, FilterState
from pose_core.filter.tracker_errors import MAX_STEP_S, update_tracker_errors
from pose_core.filter.update import robust_update
from pose_core.kernels.compiling import compiled, compiled_in_place, compiled_into_caller
from pose_core.kernels.linear_algebra import add, inverse, scaled, symmetric

MEAN_NIS_CLIP = 9.0  # [-] to which a joint's NIS is clipped before averaging
LOST_NIS = 25.0  # [-] of a joint, for a filter that has lost the person


class StepResult(NamedTuple):
    """Result of the update with a frame, in addition to the state."""

    is_finite: bool  # otherwise the filter has to be restarted
    turned_back: int  # limbs that were rotated by half a turn
    mean_nis: float  # [-] mean normalised innovation squared of the joints; NaN without joints
    lost_share: float  # [-] of the joints whose NIS is above LOST_NIS; NaN without joints


@compiled
def update_with_imus(
    constants: FilterConstants, state: FilterState, imus: ImuFrame, information: FloatArray
) -> bool:
    """Measurement update with the aligned IMUs; returns whether the result is finite.

    While no camera sends, posture prior and standing feet are part of it.

    Args:
        constants: The filter's constants.
        state: Prior state; becomes the posterior.
        imus: Samples of the IMUs whose alignment is in the state.
        information: (links, 3, 3) [1/rad²] on each link's rotation; the IMUs' share is added.
    """
    state.imus.is_used[:] = False
    for link in imus.links:
        state.imus.is_used[link] = True
    count = len(imus.links)
    if count == 0:
        return True
    is_unseen = min(state.views.silent_s) > CAMERA_TIMEOUT_S
    posture_rows = most_posture_rows(constants.posture) if is_unseen else 0
    rows = make_rows(6 * count + posture_rows, 2 * count + posture_rows, len(state.P))
    add_imu_rows(constants.imu, state, imus, rows)
    if is_unseen:
        add_posture_rows(constants.posture, state.pose.rotations, rows)
    update = robust_update(constants.imu_update, state, rows)
    if not update.is_finite:
        return False
    if is_unseen:  # with the rates that the IMUs have measured
        feet = make_rows(4, 2, len(state.P))
        add_standing_foot_rows(constants.camera.body, state, feet)
        if feet.filled[0] > 0 and not robust_update(constants.imu_update, state, feet).is_finite:
            return False
    for row in range(count):
        orientation = 2 * row  # groups alternate: orientation, rate
        noise = symmetric(rows.noise[orientation])
        precision = scaled(inverse(noise), update.weights[orientation])
        add(precision, information[imus.links[row]])
    return True


@compiled
def update_with_frame(
    constants: FilterConstants, state: FilterState, frame: CameraFrame, information: FloatArray
) -> tuple[bool, int, float, float]:
    """Measurement update with a camera's frame and the posture prior.

    Args:
        constants: The filter's constants.
        state: Prior state; becomes the posterior.
        frame: One camera's joints.
        information: (links, 3, 3) [1/rad²] on each link's rotation; the camera's share is added.

    Returns:
        Fields of a :class:`StepResult`. Numba would make it in Python, where an interrupt ends
        in a segmentation fault.
    """
    joints, posture_rows = len(frame.positions), most_posture_rows(constants.posture)
    columns, layout = len(state.P), state.layout
    if columns == layout.body_size:
        columns = layout.first_rate  # joints do not depend on rates
    rows = make_rows(3 * joints + posture_rows, joints + posture_rows, columns)
    view = predict_view(constants.camera, state, frame)
    add_camera_rows(constants.camera, state, frame, view, rows)
    joint_count = rows.filled[1]
    add_posture_rows(constants.posture, state.pose.rotations, rows)
    result = robust_update(constants.frame_update, state, rows)
    if not result.is_finite:
        return False, 0, np.nan, np.nan
    gap_s = min(state.views.silent_s[frame.sensor], MAX_STEP_S)
    state.views.silent_s[frame.sensor] = 0.0
    update = FrameUpdate(frame, view, gap_s, rows, joint_count, result)
    update_tracker_errors(constants.tracker_errors, update, state)
    note_foot_height(view.positions, gap_s, state)
    if joint_count > 0:
        estimate_shared_offsets(constants.shared_offsets, update, state)
    add_link_information(update, information)
    turned = undo_half_turns(constants.posture, state, np.empty((3, 3)))
    mean_nis, lost_share = summarise(result.nis[:joint_count])
    return True, turned, mean_nis, lost_share


@compiled_in_place
def summarise(nis: FloatArray) -> tuple[float, float]:
    """Mean of the joints' NIS, and the share that is above :data:`LOST_NIS`."""
    total, lost = 0.0, 0
    for each in nis:
        total += min(each, MEAN_NIS_CLIP)
        lost += each > LOST_NIS
    count = float(len(nis))
    return total / count, lost / count


@compiled_into_caller
def add_link_information(update: FrameUpdate, out: FloatArray) -> None:
    """Add Hᵀ (R / w)⁻¹ H of each joint's group to the links' blocks, with R's mean variance."""
    rows = update.rows
    for group in range(update.joint_count):
        first, noise = rows.first[group], rows.noise[group]
        precision = 3.0 * update.result.weights[group] / (noise[0, 0] + noise[1, 1] + noise[2, 2])
        for link in range(len(out)):
            column = rotation_column(link)
            for i in range(3):
                for k in range(3):
                    total = 0.0
                    for row in range(first, first + 3):
                        total += rows.H[row, column + i] * rows.H[row, column + k]
                    out[link, i, k] += precision * total
