r"""Offsets of joints that all cameras share.

Trackers have a permanent offset of a centimetre or two for each joint. The part that is common to
all cameras does not appear in any residual. It rotates the line between the hips, relative to which
every angle of hips and shoulders is measured, by some degrees. But averaged over a minute, a pelvis
faces the same way as the chest and is perpendicular to the spine. With m the running mean of the
waist's lateral bending or rotation over T seconds, the most likely errors of the two lines are

.. math:: e_\mathrm{hips} = -w\,\frac{\sigma_h^2}{\sigma^2}\,m, \quad
          e_\mathrm{shoulders} = w\,\frac{\sigma_s^2}{\sigma^2}\,m, \quad
          \sigma^2 = \sigma_h^2 + \sigma_s^2 + \sigma_w^2 + q / T, \quad
          w = \min(1, \frac{\nu + 1}{\nu + m^2 / \sigma^2})

with :math:`\sigma_h` and :math:`\sigma_s` the standard deviations of a line's angle due to offsets,
:math:`\sigma_w` that of people's true means, and q / T the variance that motion leaves in the mean.
The weight w of Student's t rejects a mean that is too large for offsets: the person works with the
chest turned. Lateral bending is measured with the neck, so the shoulders' share of it is zero.

The far joint of a limb that wears an aligned IMU has its offset in the filter's state, constant and
with zero prior mean. The IMU turns with the limb, but the offset with the body's heading: where the
limb has been in several postures, the IMU's alignment and the offset can be told apart.
"""

from typing import NamedTuple

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.filter.frame import FrameUpdate
from pose_core.filter.state import FilterState
from pose_core.joints import JOINT_INDEX
from pose_core.kernels.compiling import compiled_into_caller

LEFT_HIP, RIGHT_HIP, NECK = JOINT_INDEX["left_hip"], JOINT_INDEX["right_hip"], JOINT_INDEX["neck"]
LEFT_SHOULDER, RIGHT_SHOULDER = JOINT_INDEX["left_shoulder"], JOINT_INDEX["right_shoulder"]
MEMORY_S = 60.0  # [s] of the mean
STUDENT_DOF = 4.0  # [-] ν
MOTION_DENSITY = 0.02  # [rad² s] q: a waist moves by 6°, correlated over a second
BEND, TURN = 0, 1


class SharedOffsetConstants(NamedTuple):
    """Half lengths and error variances of the two lines; variances of 0 disable the estimate."""

    trunk: int  # link
    half_hips: float  # [m] from the middle to a hip
    half_shoulders: float  # [m]
    hips_variance: float  # [rad²]
    shoulders_variance: float  # [rad²]
    mean_variance: FloatArray  # (2,) [rad²] of a person's mean sideways bend and turn


@compiled_into_caller
def estimate_shared_offsets(
    constants: SharedOffsetConstants, update: FrameUpdate, state: FilterState
) -> None:
    """Update the waist's running mean with one frame, and the offsets of hips and shoulders."""
    view, gap_s = (
        update.predicted,
        update.gap_s / len(state.views.silent_s),
    )  # that this frame stands for
    state.shared.waist_s[0] = min(state.shared.waist_s[0] + gap_s, MEMORY_S)
    if state.shared.waist_s[0] == 0.0:
        return
    waist, hips, shoulders = np.empty(2), np.empty(2), np.empty(2)
    left, right = view.positions[LEFT_HIP], view.positions[RIGHT_HIP]
    across, up = left - right, view.positions[NECK] - 0.5 * (left + right)
    line = np.dot(view.rotations[constants.trunk].T, across)
    waist[BEND] = -np.arcsin(np.sum(across * up) / np.sqrt(np.sum(across**2) * np.sum(up**2)))
    waist[TURN] = np.arctan2(line[0], line[1])
    for axis in range(2):
        of_shoulders = constants.shoulders_variance if axis == TURN else 0.0
        both = constants.hips_variance + of_shoulders
        total = both + constants.mean_variance[axis] + MOTION_DENSITY / state.shared.waist_s[0]
        mean = state.shared.waist_mean[axis]
        precision = min((STUDENT_DOF + 1.0) / (STUDENT_DOF + mean**2 / total), 1.0) / total
        uncorrected = waist[axis] + both * precision * mean
        mean += gap_s / state.shared.waist_s[0] * (uncorrected - mean)
        state.shared.waist_mean[axis] = mean
        hips[axis] = constants.half_hips * constants.hips_variance * precision * mean
        shoulders[axis] = constants.half_shoulders * of_shoulders * precision * mean
    for hip, shoulder, sign in ((LEFT_HIP, LEFT_SHOULDER, 1.0), (RIGHT_HIP, RIGHT_SHOULDER, -1.0)):
        state.shared.offset[hip, 0] = sign * hips[TURN]
        state.shared.offset[hip, 2] = -sign * hips[BEND]
        state.shared.offset[shoulder, 0] = -sign * shoulders[TURN]
