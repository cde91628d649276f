r"""Noise of each IMU, learnt from what two cameras' residuals have in common.

A filter that weighs its measurements rightly leaves residuals that are not correlated. Where one
view after the other sees a link turned the same way from its prediction, its IMU is believed too
much: it swings on a loose strap or on soft tissue, or its magnetic field changes. With the joints'
residuals r and the vector u from a link's start to its end,

.. math:: e = u \times (r_\mathrm{end} - r_\mathrm{start}) / |u|^2 - \bar e, \quad
          \rho = \frac{\sum e_1 \cdot e_2}{\sum (e_1^2 + e_2^2) / 2}, \quad
          \frac{d}{dt} \log f = k\,(\rho - \rho_0)

f is the factor of the standard deviations of the IMU's orientation and angular velocity, at least
one. The cameras' own noise is independent and does not change the sum of products; what both see
wrong for long is in the mean :math:`\bar e` of each view. Trackers that smooth attenuate fast
motion alike, and are late: :math:`\rho_0` grows to 1 with their mean delay. A single camera's
errors cannot be told from an IMU's, so f is not learnt from it.

References:
    Mehra (1970), On the identification of variances and adaptive Kalman filtering, IEEE
    Transactions on Automatic Control 15.
"""

import numpy as np
from numpy.typing import NDArray

from pose_core.arrays import FloatArray
from pose_core.filter.frame import FrameUpdate, groups_by_joint
from pose_core.filter.state import FilterState
from pose_core.filter.view_noise import NEWEST_S, VISIBLE
from pose_core.kernels.compiling import compiled, compiled_into_caller

GAIN = 1.0  # [1/s] k
MAX_FACTOR = 20.0  # [-]
MEMORY_S = 10.0  # [s] of the sums
MEAN_S = 1.0  # [s] time constant of the mean residuals
SMOOTHED_FROM_S, SMOOTHED_S = 0.08, 0.12  # [s] mean delay of two trackers that may smooth, and do
MAX_TURN = 0.5  # [rad] above which a camera has lost the joint


@compiled
def estimate_imu_noise(
    starts: NDArray[np.int64],
    ends: NDArray[np.int64],
    usual_correlation: FloatArray,
    update: FrameUpdate,
    state: FilterState,
) -> None:
    """Update the factor of each IMU's noise by one frame and the other cameras' last ones.

    Args:
        starts: Joint at the start of each link, (links,); −1 for the root, which is left out.
        ends: Joint at the end of each link, (links,).
        usual_correlation: ρ0 of sound IMUs and trackers that are in time, (links,) [-]: both
            trackers share some errors.
        update: The update with the frame.
        state: The state after it; changed.
    """
    sensor, cameras = update.frame.sensor, len(state.views.silent_s)
    share = 1.0 - np.exp(-update.gap_s / MEAN_S)
    kept = np.exp(-update.gap_s / MEMORY_S / cameras)
    group_of = groups_by_joint(update)
    for link in range(len(ends)):
        residual = state.imus.link_residual[sensor, link]
        residual[:] = np.nan
        if not state.imus.is_used[link] or starts[link] < 0:
            continue
        turned = turn_of_link(update, starts[link], ends[link], group_of)
        if not np.sum(turned**2) < MAX_TURN**2:
            continue
        mean = state.imus.link_mean_residual[sensor, link]
        mean += share * (turned - mean)
        residual[:] = turned - mean
        sums = state.imus.link_residual_sums[link]
        for other in range(cameras):
            theirs = state.imus.link_residual[other, link]
            if other == sensor or state.views.silent_s[other] > NEWEST_S or np.isnan(theirs[0]):
                continue
            sums *= kept
            sums[0] += np.sum(residual * theirs)
            sums[1] += 0.5 * np.sum(residual**2 + theirs**2)
            late_s = 0.5 * (state.views.delay[sensor] + state.views.delay[other])
            smoothed = min(
                max((late_s - SMOOTHED_FROM_S) / (SMOOTHED_S - SMOOTHED_FROM_S), 0.0), 1.0
            )
            usual = usual_correlation[link] + (1.0 - usual_correlation[link]) * smoothed
            excess = sums[0] / sums[1] - usual
            factor = state.imus.noise[link] * np.exp(GAIN * update.gap_s * excess)
            state.imus.noise[link] = min(max(factor, 1.0), MAX_FACTOR)


@compiled_into_caller
def turn_of_link(
    update: FrameUpdate, start: int, end: int, group_of: NDArray[np.int64]
) -> FloatArray:
    """Rotation vector [rad] from a link as predicted to as seen, (3,); NaN unless both ends are."""
    first, last = group_of[start], group_of[end]
    view, rows = update.predicted, update.rows
    if first < 0 or last < 0 or max(view.occlusion[start], view.occlusion[end]) > VISIBLE:
        return np.full(3, np.nan)
    u = view.positions[end] - view.positions[start]
    start_row, end_row = rows.first[first], rows.first[last]
    apart = rows.residual[end_row : end_row + 3] - rows.residual[start_row : start_row + 3]
    return np.cross(u, apart) / np.sum(u**2)
