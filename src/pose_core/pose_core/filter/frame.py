"""A camera's frame, its prediction, and the update with it."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pose_core.arrays import FloatArray
from pose_core.filter.rows import Rows
from pose_core.filter.update import UpdateResult
from pose_core.joints import TrackingState
from pose_core.kernels.compiling import compiled_in_place, compiled_into_caller


class CameraFrame(NamedTuple):
    """Joints of one person, as one camera measures them."""

    sensor: int
    positions: FloatArray  # (joints, 3) [m] in map; NaN if not measured
    tracking_state: NDArray[np.uint8]  # (joints,)
    camera: FloatArray  # (3,) [m] position of the camera in map


class PredictedView(NamedTuple):
    """Predicted measurement of one frame."""

    positions: FloatArray  # (joints, 3) [m] in map
    levers: FloatArray  # (joints, links, 3) [m] lever arm of each link to each joint, in map
    velocity: FloatArray  # (joints, 3) [m/s]
    rotations: FloatArray  # (links, 3, 3) R_map_link
    occlusion: FloatArray  # (joints,) [-] degree of self-occlusion, 0 to 1


class FrameUpdate(NamedTuple):
    """The update with one frame, from which the errors of its view are estimated."""

    frame: CameraFrame
    predicted: PredictedView
    gap_s: float  # [s] since the camera's last frame
    rows: Rows  # with the residuals before the update, those of joints first
    joint_count: int  # groups of rows that are joints
    result: UpdateResult


@compiled_into_caller
def groups_by_joint(update: FrameUpdate) -> NDArray[np.int64]:
    """The group of rows of each joint, (joints,); −1 without one."""
    groups = np.full(len(update.frame.positions), -1)
    for group in range(update.joint_count):
        groups[update.rows.source[group]] = group
    return groups


@compiled_in_place
def is_measured(frame: CameraFrame, joint: int) -> bool:
    """Whether a frame measures a joint."""
    if frame.tracking_state[joint] == TrackingState.NOT_TRACKED:
        return False
    x, y, z = frame.positions[joint, 0], frame.positions[joint, 1], frame.positions[joint, 2]
    return np.isfinite(x) and np.isfinite(y) and np.isfinite(z)
