"""Reference implementation of the errors of trackers, as plain functions on the filter's state."""

import numpy as np

from pose_bench.reference.default_measurements import Group, PlainView
from pose_core.arrays import FloatArray
from pose_core.filter.state import FilterState
from pose_core.filter.tracker_errors import TrackerErrorConstants
from pose_core.joints import TrackingState

CAMERA_TIMEOUT_S = 0.15  # [s]
DELAYS_S = (-0.02, 0.2)  # [s]
DELAY_GAIN = 2.2  # [-]
LINK_DELAY_SCALE = 0.1  # [m]
USUAL_VIEW_NOISE = 0.03  # [m]
VISIBLE, COMPARED_S, COMPARED_JOINTS, COMPARED_DEVIATIONS = 0.3, 0.05, 6, 4.0
VIEW_NOISE_S, VIEW_APART_S = 5.0, 1.0  # [s]
DEPTH_POWER_S, DEPTH_NOISE_S = 10.0, 3.0  # [s]
MIN_DEPTH_VARIANCE = 0.005**2  # [m²]
IMU_NOISE_GAIN, MAX_IMU_NOISE = 1.0, 20.0  # [1/s], [-]
IMU_NOISE_S, MEAN_TURN_S, MAX_TURN = 10.0, 1.0, 0.5  # [s], [s], [rad]
SMOOTHING_DELAYS_S = (0.08, 0.12)  # [s]
SMOOTHED_NIS_CLIP = 400.0  # [-]
CONTRADICTED = {1: (25.0, 0.5), 2: (8.0, 1.0)}  # least NIS, and weight, by number of cameras


def update_tracker_errors(
    constants: TrackerErrorConstants,
    state: FilterState,
    view: PlainView,
    joints: list[Group],
    common: tuple[float, float],
) -> None:
    """Update all errors with one frame.

    Args:
        constants: Constants of the filter.
        state: The state after the update with the frame; changed.
        view: The frame and its prediction.
        joints: Its joints, with their weights; the common error in depth is removed.
        common: This error and its variance, relative to the expected ones.
    """
    estimate_view_noise(state, view, joints)
    estimate_depth_errors(state, view, joints, *common)
    estimate_offsets(state, view, joints)
    estimate_view_apart(state, view, joints)
    estimate_delay(constants, state, view, joints)
    estimate_imu_noise(constants, state, view, joints)
    note_contradictions(constants, state, view, joints)


def estimate_view_noise(state: FilterState, view: PlainView, joints: list[Group]) -> None:
    """Update the views' noise by the differences of their visible joints' heights."""
    frame = view.frame
    visible = (view.occlusion < VISIBLE) & (frame.tracking_state == TrackingState.TRACKED)
    visible &= np.isin(np.arange(len(visible)), [group.source for group in joints])
    height = np.where(visible, frame.positions[:, 2] - view.positions[:, 2], np.nan)
    state.views.residual[frame.sensor] = height
    limit = COMPARED_DEVIATIONS * USUAL_VIEW_NOISE * np.sqrt(2.0 * state.views.noise[0])
    for other, silent_s in enumerate(state.views.silent_s):
        apart = height - state.views.residual[other]
        apart = apart[np.isfinite(apart)]
        if other == frame.sensor or silent_s > COMPARED_S or len(apart) < COMPARED_JOINTS:
            continue
        variance = 0.5 * np.clip(apart, -limit, limit).var() / USUAL_VIEW_NOISE**2
        share = 1.0 - np.exp(-view.gap_s / VIEW_NOISE_S)
        state.views.noise[:] += share * (variance - state.views.noise)


def estimate_depth_errors(
    state: FilterState,
    view: PlainView,
    joints: list[Group],
    common_error: float,
    common_variance: float,
) -> None:
    """Update this view's errors along its rays; remove the common one from the residuals."""
    sensor, gap_s = view.frame.sensor, view.gap_s
    variance, power = (
        state.views.depth_error_variance[sensor],
        state.views.depth_error_power[sensor],
    )
    state.views.depth_error[sensor] += np.sqrt(variance) * common_error
    state.views.depth_error_variance[sensor] = variance * common_variance
    for group in joints:
        group.residual = group.residual - common_error * group.common
    others = np.delete(state.views.silent_s, sensor)
    if not joints or not np.any(others < CAMERA_TIMEOUT_S):
        return
    squared = state.views.depth_error[sensor] ** 2 + state.views.depth_error_variance[sensor]
    power += (1.0 - np.exp(-gap_s / DEPTH_POWER_S)) * (squared - power)
    state.views.depth_error_power[sensor] = max(power, MIN_DEPTH_VARIANCE)
    excess = []
    for group in joints:
        ray = view.ray(group.source)
        noise = np.outer(group.residual, group.residual) - group.spread
        along = ray @ noise @ ray
        excess.append(along - 0.5 * (np.trace(noise) - along))
    mean = np.average(excess, weights=[group.weight for group in joints])
    share = 1.0 - np.exp(-gap_s / DEPTH_NOISE_S)
    noise = state.views.depth_noise[sensor]
    state.views.depth_noise[sensor] = max(noise + share * (mean - noise), 0.0)


def estimate_offsets(state: FilterState, view: PlainView, joints: list[Group]) -> None:
    """Move this view's offset to the residual, and the others' so that the mean is kept."""
    sensor, sensors = view.frame.sensor, len(state.views.silent_s)
    if sensors < 2:
        return
    shares = np.full(sensors, -1.0 / (sensors - 1))
    shares[sensor] = 1.0
    for group in joints:
        variance = state.views.offset_variance[sensor, group.source]
        gain = 3.0 * variance / np.trace(group.noise / group.weight + group.spread)
        change = gain * view.heading().T @ group.residual
        state.views.offset[:, group.source] += np.outer(shares, change)
        state.views.offset_variance[sensor, group.source] = (1.0 - gain) * variance


def estimate_view_apart(state: FilterState, view: PlainView, joints: list[Group]) -> None:
    """Smooth the mean distance of a view's joints from the predicted ones."""
    if joints:
        measured, old = view.frame.positions, state.views.apart[view.frame.sensor]
        apart = [measured[each.source] - view.positions[each.source] for each in joints]
        old += (1.0 - np.exp(-view.gap_s / VIEW_APART_S)) * (np.mean(apart, axis=0) - old)


def estimate_delay(
    constants: TrackerErrorConstants, state: FilterState, view: PlainView, joints: list[Group]
) -> None:
    """Regress the bones' residuals on their velocities."""
    sensor = view.frame.sensor
    seen = {group.source: group for group in joints}
    sums, delay_s = state.views.delay_sums[sensor], state.views.delay[sensor]
    sums *= np.exp(-view.gap_s / constants.delay_memory_s)
    for link, (start, end) in enumerate(zip(constants.starts, constants.ends, strict=True)):
        if not state.imus.is_used[link] or start not in seen or end not in seen:
            continue
        v = view.velocity[end] - view.velocity[start]
        r = seen[end].residual - seen[start].residual
        weight = min(seen[start].weight, seen[end].weight)
        weight *= 1.0 - max(view.occlusion[start], view.occlusion[end])
        sums[link] += weight * np.array([v @ v, delay_s * (v @ v) - DELAY_GAIN * v @ r])
    delay_s = combined_delay(constants, sums)
    state.views.delay[sensor] = np.clip(delay_s, *DELAYS_S)


def combined_delay(constants: TrackerErrorConstants, sums: FloatArray) -> float:
    """Mean of the links' delays, each with the variance between links in addition."""
    with_imu = sums[:, 0] > 0.0
    (W, product), k = sums[with_imu].T, constants.strap_swing[with_imu]
    variance, between = LINK_DELAY_SCALE**2 / W, 0.0
    if len(W) > 1:
        excess = W @ (product / W - product.sum() / W.sum()) ** 2
        excess -= (len(W) - 1) * LINK_DELAY_SCALE**2
        between = max(excess, 0.0) / (W @ k**2 - (W * k) @ (W * k) / W.sum())
    precision = 1.0 / (variance + between * k**2)
    precision = np.append(precision, constants.delay_prior / LINK_DELAY_SCALE**2)
    delays = np.append(product / W, constants.known_delay_s)
    return float(precision @ delays / precision.sum())


def estimate_imu_noise(
    constants: TrackerErrorConstants, state: FilterState, view: PlainView, joints: list[Group]
) -> None:
    """Adapt each IMU's noise to the correlation of two views' residuals of its link."""
    sensor, cameras = view.frame.sensor, len(state.views.silent_s)
    recent = [each for each in range(cameras) if state.views.silent_s[each] <= COMPARED_S]
    visible = {each.source: each for each in joints if view.occlusion[each.source] <= VISIBLE}
    state.imus.link_residual[sensor] = np.nan
    for link, (start, end) in enumerate(zip(constants.starts, constants.ends, strict=True)):
        if not state.imus.is_used[link] or start not in visible or end not in visible:
            continue
        bone = view.positions[end] - view.positions[start]
        turned = np.cross(bone, visible[end].residual - visible[start].residual) / (bone @ bone)
        if np.linalg.norm(turned) > MAX_TURN:
            continue
        mean = state.imus.link_mean_residual[sensor, link]
        mean += (1.0 - np.exp(-view.gap_s / MEAN_TURN_S)) * (turned - mean)
        own = state.imus.link_residual[sensor, link] = turned - mean
        for other in set(recent) - {sensor}:
            theirs = state.imus.link_residual[other, link]
            if np.all(np.isfinite(theirs)):
                sums = state.imus.link_residual_sums[link]
                sums *= np.exp(-view.gap_s / IMU_NOISE_S / cameras)
                sums += np.array([own @ theirs, 0.5 * (own @ own + theirs @ theirs)])
                delay_s = np.mean(state.views.delay[[sensor, other]])
                may_smooth = np.interp(delay_s, SMOOTHING_DELAYS_S, (0.0, 1.0))
                unusual = (1.0 - may_smooth) * (1.0 - constants.usual_correlation[link])
                excess = sums[0] / sums[1] - 1.0 + unusual
                factor = state.imus.noise[link] * np.exp(IMU_NOISE_GAIN * view.gap_s * excess)
                state.imus.noise[link] = np.clip(factor, 1.0, MAX_IMU_NOISE)


def note_contradictions(
    constants: TrackerErrorConstants, state: FilterState, view: PlainView, joints: list[Group]
) -> None:
    """Smooth the joints' NIS; note the links that all active cameras contradict."""
    sensor, gap_s = view.frame.sensor, view.gap_s
    state.views.silent_s[sensor] = 0.0
    share = 1.0 - np.exp(-gap_s / constants.nis_memory_s)
    newest = np.zeros(state.views.smoothed_nis.shape[1])
    for group in joints:
        if view.frame.tracking_state[group.source] == TrackingState.TRACKED:
            newest[group.source] = min(group.nis, SMOOTHED_NIS_CLIP)
    state.views.smoothed_nis[sensor] += share * (newest - state.views.smoothed_nis[sensor])
    sends = state.views.silent_s < CAMERA_TIMEOUT_S
    most, weight = CONTRADICTED[min(int(np.sum(sends)), 2)]
    least = state.views.smoothed_nis[sends].min(axis=0)[constants.ends]
    passed_s = weight * np.where(least > most, gap_s, -gap_s) / len(sends)
    state.imus.contradicted_s[:] = np.maximum(state.imus.contradicted_s + passed_s, 0.0)
