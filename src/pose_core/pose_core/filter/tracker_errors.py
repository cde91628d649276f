r"""Quantities estimated outside the state: errors of views, delays of trackers, contradictions.

Two cameras measure the same joint at positions that differ slowly. The difference is estimated as
one offset for each view, with a scalar gain. The offsets have zero mean over the cameras, because a
common offset cannot be distinguished from the pose. The output then does not alternate between the
cameras.

A frame's stamp is first corrected by its tracker's delay. Where IMUs measure the rates, the
remaining delay shows as a residual along the velocity. It is estimated by a robust regression over
the links that carry an IMU, with a prior around the known delay. An IMU whose strap swings lags or
leads its link, which looks like a delay of this link's own. The more the links' delays differ, the
less each link counts by the speed that it had, thighs least.

Two views that are apart as a whole, as after a bump, cannot both be right: each one's mean distance
from the state is part of the position's published variance.

Where all cameras measure a joint far from its prediction for long, they contradict the IMU on its
link (:class:`pose_core.filter.imu_alignments.ImuAlignments`).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pose_core.filter.camera import heading_cosine_sine
from pose_core.filter.depth_errors import estimate_depth_errors
from pose_core.filter.frame import FrameUpdate, groups_by_joint
from pose_core.filter.imu_noise import estimate_imu_noise
from pose_core.filter.state import CAMERA_TIMEOUT_S, FilterState
from pose_core.filter.view_noise import estimate_view_noise
from pose_core.joints import TrackingState
from pose_core.kernels.compiling import compiled, compiled_in_place, compiled_into_caller

SMOOTHED_NIS_CLIP = 400.0  # [-] to which a joint's NIS is clipped before it is smoothed
MAX_STEP_S = 0.1  # [s] upper bound of the time between frames, for smoothing
MIN_DELAY_S, MAX_DELAY_S = -0.02, 0.2  # [s] of a tracker
DELAY_GAIN = 2.2
"""[-] The state follows a late camera in part, so residuals show less than half of a delay. With
this gain, no lag was left in sessions with nine IMUs."""
DELAY_SCALE = 0.2
"""[m] Standard deviation of a delay, times the root of the sum of squared speeds: the error of the
delays in simulated sessions."""
LINK_DELAY_SCALE = 0.1  # [m] the same of the differences between links
VIEW_APART_MEMORY_S = 1.0  # [s] over which a view's distance from the state is averaged
CONTRADICTED = 8.0  # [-] smoothed NIS above which the cameras contradict a link
CONTRADICTED_BY_ONE = 25.0  # [-] the same of a single camera, whose gross errors last
WEIGHT_OF_ONE = 0.5  # [-] of the time for which a single camera contradicts


class TrackerErrorConstants(NamedTuple):
    """Parameters of delays and contradictions."""

    starts: NDArray[np.int64]  # (links,) joint at the start of each link; −1 for the root
    ends: NDArray[np.int64]  # (links,) joint at the end of each link
    strap_swing: NDArray[np.float64]  # (links,) [-] k of :func:`combined_delay`
    usual_correlation: NDArray[np.float64]  # (links,) [-] ρ0 of pose_core.filter.imu_noise
    delay_prior: float  # [m²/s²] λ of :func:`combined_delay`
    delay_memory_s: float  # of its sums
    known_delay_s: float  # [s] prior mean of the trackers' delays, from the parameters
    nis_memory_s: float  # [s] time constant with which the joints' NIS is smoothed


@compiled_into_caller
def update_tracker_errors(
    constants: TrackerErrorConstants, update: FrameUpdate, state: FilterState
) -> None:
    """Update offsets, delay and contradictions with one frame, in place.

    The view's common error in depth is removed from the residuals.
    """
    estimate_view_noise(update, state)
    estimate_depth_errors(update, state)
    estimate_offsets(update, state)
    estimate_view_apart(update, state)
    estimate_delay(constants, update, state)
    links = constants.starts, constants.ends, constants.usual_correlation
    estimate_imu_noise(*links, update, state)
    smooth_nis(constants, update, state)
    add_contradictions(constants, update, state)


@compiled_in_place
def estimate_offsets(update: FrameUpdate, state: FilterState) -> None:
    """Update the offsets of the views and their variances with one frame's residuals."""
    sensor, sensors = update.frame.sensor, len(state.views.silent_s)
    if sensors < 2:
        return
    rows, result, residual = update.rows, update.result, update.rows.residual
    c, s = heading_cosine_sine(update.predicted.rotations[0])
    for group in range(update.joint_count):
        joint, first = rows.source[group], rows.first[group]
        noise = rows.noise[group]
        variance = state.views.offset_variance[sensor, joint]
        total = (noise[0, 0] + noise[1, 1] + noise[2, 2]) / result.weights[group]
        for axis in range(3):
            total += result.HPHt[first + axis, first + axis]
        gain = 3.0 * variance / total
        x, y, z = gain * residual[first], gain * residual[first + 1], gain * residual[first + 2]
        change = (c * x + s * y, c * y - s * x, z)
        for axis in range(3):
            state.views.offset[sensor, joint, axis] += change[axis]
            for other in range(sensors):
                if other != sensor:
                    state.views.offset[other, joint, axis] -= change[axis] / (sensors - 1)
        state.views.offset_variance[sensor, joint] *= 1.0 - gain


@compiled_in_place
def estimate_view_apart(update: FrameUpdate, state: FilterState) -> None:
    """Update the mean distance of a view's joints from the predicted ones."""
    if update.joint_count == 0:
        return
    apart = state.views.apart[update.frame.sensor]
    share = 1.0 - np.exp(-update.gap_s / VIEW_APART_MEMORY_S)
    for axis in range(3):
        total = 0.0
        for group in range(update.joint_count):
            joint = update.rows.source[group]
            total += update.frame.positions[joint, axis] - update.predicted.positions[joint, axis]
        apart[axis] += share * (total / update.joint_count - apart[axis])


@compiled_into_caller
def estimate_delay(
    constants: TrackerErrorConstants, update: FrameUpdate, state: FilterState
) -> None:
    r"""Update the sums of each link's delay, and the estimated delay of a tracker.

    .. math::
        W = \sum w\,v^2, \quad W \tau = \sum w\,v \cdot (\tau_k v - g\,r)

    v and r are the velocity and the residual of the link's end relative to its start,
    :math:`\tau_k` the estimate by which the frame's stamp was corrected, and g is
    :data:`DELAY_GAIN`.
    """
    frame, view, rows, weights = update.frame, update.predicted, update.rows, update.result.weights
    group_of = groups_by_joint(update)
    sums, delay_s = state.views.delay_sums[frame.sensor], state.views.delay[frame.sensor]
    sums *= np.exp(-update.gap_s / constants.delay_memory_s)
    for link in range(len(constants.ends)):
        start, end = constants.starts[link], constants.ends[link]
        if not state.imus.is_used[link] or start < 0:
            continue
        first, last = group_of[start], group_of[end]
        if first < 0 or last < 0:
            continue
        weight = min(weights[first], weights[last])
        weight *= 1.0 - max(view.occlusion[start], view.occlusion[end])
        for axis in range(3):
            v = view.velocity[end, axis] - view.velocity[start, axis]
            r = rows.residual[rows.first[last] + axis] - rows.residual[rows.first[first] + axis]
            sums[link, 0] += weight * v * v
            sums[link, 1] += weight * v * (delay_s * v - DELAY_GAIN * r)
    delay_s = combined_delay(constants, sums)[0]
    state.views.delay[frame.sensor] = min(max(delay_s, MIN_DELAY_S), MAX_DELAY_S)


@compiled
def combined_delay(
    constants: TrackerErrorConstants, sums: NDArray[np.float64]
) -> tuple[float, float]:
    r"""Combine the delays of the links; the delay, unbounded, and its standard deviation [s].

    Links differ by :math:`(b\,k)^2` beyond the variance :math:`s^2 / W` of each, with s
    :data:`LINK_DELAY_SCALE`, :math:`\tau_0` the known delay, :math:`\bar\tau` the mean by W:

    .. math::
        \tau = \frac{\lambda\tau_0 + \sum W^* \tau}{\lambda + \sum W^*}, \quad
        \frac{1}{W^*} = \frac{1}{W} + \frac{b^2 k^2}{s^2}, \quad
        b^2 = \frac{\sum W (\tau - \bar\tau)^2 - (n - 1) s^2}
        {\sum W k^2 - \sum W^2 k^2 / \sum W}

    Straps that all lag bias every link alike, so b is part of the deviation, however many links.

    References:
        DerSimonian, Laird (1986), Meta-analysis in clinical trials, Controlled Clinical Trials 7.
    """
    total, product, squared, spread_of_b, common, links = 0.0, 0.0, 0.0, 0.0, 0.0, 0
    for link in range(len(sums)):
        W = sums[link, 0]
        if W > 0.0:
            total += W
            product += sums[link, 1]
            squared += sums[link, 1] ** 2 / W
            spread_of_b += W * constants.strap_swing[link] ** 2
            common += (W * constants.strap_swing[link]) ** 2
            links += 1
    b_squared = 0.0
    if links > 1:
        excess = squared - product**2 / total - (links - 1) * LINK_DELAY_SCALE**2
        if excess > 0.0:
            b_squared = excess / (spread_of_b - common / total)
    weight, product = constants.delay_prior, constants.delay_prior * constants.known_delay_s
    for link in range(len(sums)):
        apart = b_squared * (constants.strap_swing[link] / LINK_DELAY_SCALE) ** 2
        share = 1.0 / (1.0 + sums[link, 0] * apart)  # W* / W
        weight += share * sums[link, 0]
        product += share * sums[link, 1]
    return product / weight, np.sqrt(DELAY_SCALE**2 / weight + b_squared)


@compiled_into_caller
def smooth_nis(constants: TrackerErrorConstants, update: FrameUpdate, state: FilterState) -> None:
    """Update a camera's smoothed NIS of each joint; of joints that it does not track it decays."""
    frame, smoothed = update.frame, state.views.smoothed_nis[update.frame.sensor]
    share = 1.0 - np.exp(-update.gap_s / constants.nis_memory_s)
    smoothed *= 1.0 - share
    for group in range(update.joint_count):
        joint = update.rows.source[group]
        if frame.tracking_state[joint] == TrackingState.TRACKED:
            smoothed[joint] += share * min(update.result.nis[group], SMOOTHED_NIS_CLIP)


@compiled_into_caller
def add_contradictions(
    constants: TrackerErrorConstants, update: FrameUpdate, state: FilterState
) -> None:
    """Update for how long all cameras have contradicted each link, by their smoothed NIS."""
    passed_s = update.gap_s / len(state.views.silent_s)  # that this frame stands for
    is_single = np.sum(state.views.silent_s < CAMERA_TIMEOUT_S) == 1
    if is_single:
        passed_s *= WEIGHT_OF_ONE
    most = CONTRADICTED_BY_ONE if is_single else CONTRADICTED
    for link in range(len(constants.ends)):
        least = np.inf
        for sensor in range(len(state.views.silent_s)):
            if state.views.silent_s[sensor] < CAMERA_TIMEOUT_S:
                least = min(least, state.views.smoothed_nis[sensor, constants.ends[link]])
        change_s = passed_s if least > most else -passed_s
        state.imus.contradicted_s[link] = max(state.imus.contradicted_s[link] + change_s, 0.0)
