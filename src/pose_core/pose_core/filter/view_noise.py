r"""Noise of the joints that cameras measure, learnt from how far two views are apart.

.. math:: R = R_0\,\sigma / \sigma_0, \quad
          \sigma^2 = \tfrac{1}{2}\,\mathrm{var}_j \left(r_{1j} - r_{2j}\right), \quad
          r_{cj} = (z_{cj} - p_j) \cdot e_z

:math:`R_0` is the variance of ``CameraNoise.stddev``, for trackers with :math:`\sigma_0`.

Of two visible joints' residuals along the vertical, the difference is independent of how well the
filter follows the motion; it contains the views' slow offsets, which the innovations do not show.
An error of the extrinsics moves a whole view, which does not change the variance over the joints;
errors along the rays are hardly vertical. Which of two views is wrong cannot be told, so the
variance is one for all cameras. A single camera has the usual one.
"""

import numpy as np

from pose_core.filter.frame import FrameUpdate
from pose_core.filter.state import FilterState
from pose_core.joints import TrackingState
from pose_core.kernels.compiling import compiled_into_caller

USUAL_VARIANCE = 0.03**2  # [m²] σ0²
MIN_SCALE, MAX_SCALE = 0.25, 2.0  # [-] of R
MEMORY_S = 5.0  # [s]
NEWEST_S = 0.05  # [s] largest age of the view that is compared
VISIBLE = 0.3  # [-] largest occlusion of a joint that is compared
MIN_JOINTS = 6  # [-]
MAX_DIFFERENCE = 4.0  # [-] in standard deviations, to which differences are clipped


@compiled_into_caller
def noise_scale(state: FilterState) -> float:
    """Factor [-] of the variance of a visible joint."""
    return min(max(np.sqrt(state.views.noise[0]), MIN_SCALE), MAX_SCALE)


@compiled_into_caller
def estimate_view_noise(update: FrameUpdate, state: FilterState) -> None:
    """Update the noise by the differences between a frame and the other cameras' last ones."""
    frame, predicted = update.frame, update.predicted
    residual = state.views.residual[frame.sensor]
    residual[:] = np.nan
    for group in range(update.joint_count):
        joint = update.rows.source[group]
        is_tracked = frame.tracking_state[joint] == TrackingState.TRACKED
        if is_tracked and predicted.occlusion[joint] < VISIBLE:
            residual[joint] = frame.positions[joint, 2] - predicted.positions[joint, 2]
    share = 1.0 - np.exp(-update.gap_s / MEMORY_S)
    limit = MAX_DIFFERENCE * np.sqrt(2.0 * USUAL_VARIANCE * state.views.noise[0])
    for other in range(len(state.views.silent_s)):
        if other == frame.sensor or state.views.silent_s[other] > NEWEST_S:
            continue
        difference = residual - state.views.residual[other]
        difference = difference[np.isfinite(difference)]
        if len(difference) >= MIN_JOINTS:
            difference = np.minimum(np.maximum(difference, -limit), limit)
            relative = 0.5 * np.var(difference) / USUAL_VARIANCE
            state.views.noise[0] += share * (relative - state.views.noise[0])
