r"""Quantities estimated outside the state: offsets of views, delays of trackers, process noise.

Two cameras measure the same joint at positions that differ slowly. The difference is estimated as
one offset for each view, with a scalar gain. The offsets have zero mean over the cameras, because a
common offset cannot be distinguished from the pose. The output then does not alternate between the
cameras.

A frame's stamp is first corrected by its tracker's delay. Where IMUs measure the rates, the
remaining delay shows as a residual along the velocity. It is estimated by a robust regression over
the links that carry an IMU, with a prior around the known delay.

Where all cameras measure a joint farther from its prediction than the covariance allows, the
process noise of its link grows until they agree again.
"""

import numpy as np
from numpy.typing import NDArray

from pose_core.filter.camera import CameraFrame, View, heading_of
from pose_core.filter.rows import Rows
from pose_core.filter.state import CAMERA_TIMEOUT_S, FilterState
from pose_core.kernels.compiling import compiled, compiled_in_place
from pose_core.streams.samples import FloatArray

LARGEST_DISTANCE = 400.0  # [-] to which a squared innovation distance is clipped
LONGEST_GAP_S = 0.1  # [s] upper bound of the time between frames, for smoothing
SHORTEST_DELAY_S, LONGEST_DELAY_S = -0.02, 0.15  # [s] of a tracker
DELAY_GAIN = 1.5  # [-] the state follows a late camera in part, so the residual is too small
CONTRADICTED = 25.0  # [-] smoothed NIS above which the cameras contradict a link


@compiled_in_place
def estimate_offsets(
    state: FilterState,
    frame: CameraFrame,
    view: View,
    rows: Rows,
    residual: FloatArray,
    spread: FloatArray,
    weights: FloatArray,
) -> None:
    """Update the offsets of the views with one frame's residuals.

    Args:
        state: The state; offsets and their variances are updated.
        frame: The frame.
        view: Its prediction.
        rows: Measurement rows of the update, those of joints first.
        residual: Residuals before the update, (rows,) [m].
        spread: Diagonal of H P Hᵀ, (rows,) [m²].
        weights: Weights of the groups, (groups,).
    """
    sensors = len(state.silent_s)
    if sensors < 2:
        return
    c, s = heading_of(view.rotations[0])
    for group in range(rows.filled[1]):
        if rows.size[group] != 3:
            break
        joint, first = rows.source[group], rows.first[group]
        noise = rows.noise[group]
        variance = state.offset_variance[frame.sensor, joint]
        total = (noise[0, 0] + noise[1, 1] + noise[2, 2]) / weights[group]
        total += spread[first] + spread[first + 1] + spread[first + 2]
        gain = 3.0 * variance / total
        x, y, z = gain * residual[first], gain * residual[first + 1], gain * residual[first + 2]
        change = (c * x + s * y, c * y - s * x, z)
        for axis in range(3):
            state.offset[frame.sensor, joint, axis] += change[axis]
            for other in range(sensors):
                if other != frame.sensor:
                    state.offset[other, joint, axis] -= change[axis] / (sensors - 1)
        state.offset_variance[frame.sensor, joint] *= 1.0 - gain


@compiled_in_place
def estimate_delay(
    starts: NDArray[np.int64],
    ends: NDArray[np.int64],
    prior: float,
    known_delay_s: float,
    memory_s: float,
    state: FilterState,
    frame: CameraFrame,
    view: View,
    rows: Rows,
    weights: FloatArray,
    group_of: NDArray[np.int64],
) -> None:
    r"""Update the estimated delay of a tracker.

    .. math:: \tau = (\lambda\tau_0 - \sum w\,v \cdot r) / (\lambda + \sum w\,v^2)

    Args:
        starts: Joint at the start of each link, (links,); −1 for the root.
        ends: Joint at the end of each link, (links,).
        prior: λ [m²/s²].
        known_delay_s: The prior's mean, τ₀ [s].
        memory_s: Time constant of the sums [s].
        state: The state; delay and sums are updated.
        frame: The frame; it must not be late.
        view: Its prediction, for the stamp corrected by the present estimate.
        rows: Measurement rows with the residuals before the update, those of joints first.
        weights: Weights of the groups, (groups,).
        group_of: Work array for the group of each joint, (joints,).
    """
    group_of[:] = -1
    for group in range(rows.filled[1]):
        if rows.size[group] == 3:
            group_of[rows.source[group]] = group
    sums, tau_s = state.delay_sums[frame.sensor], state.delay[frame.sensor]
    keep = np.exp(-min(state.silent_s[frame.sensor], LONGEST_GAP_S) / memory_s)
    sums[0] *= keep
    sums[1] *= keep
    for link in range(len(ends)):
        if state.imu_column[link] < 0 or starts[link] < 0:
            continue
        first, last = group_of[starts[link]], group_of[ends[link]]
        if first < 0 or last < 0:
            continue
        weight = min(weights[first], weights[last])
        weight *= 1.0 - max(view.hidden[starts[link]], view.hidden[ends[link]])
        for axis in range(3):
            v = view.velocity[ends[link], axis] - view.velocity[starts[link], axis]
            r = rows.residual[rows.first[last] + axis] - rows.residual[rows.first[first] + axis]
            sums[0] += weight * v * v
            sums[1] += weight * v * (tau_s * v - DELAY_GAIN * r)
    delay = (sums[1] + prior * known_delay_s) / (sums[0] + prior)
    state.delay[frame.sensor] = min(max(delay, SHORTEST_DELAY_S), LONGEST_DELAY_S)


@compiled
def adapt(
    ends: NDArray[np.int64],
    most: float,
    adapted_distance: float,
    memory_s: float,
    state: FilterState,
    sensor: int,
    rows: Rows,
    distance: FloatArray,
) -> None:
    """Update the factors of the process noise and the durations of contradiction.

    Args:
        ends: Joint at the end of each link, (links,).
        most: Largest factor [-].
        adapted_distance: Smoothed NIS from which the factor grows [-].
        memory_s: Time constant of the smoothing [s].
        state: The state.
        sensor: Index of the frame's sensor.
        rows: Measurement rows of the update.
        distance: Squared innovation distances of the groups.
    """
    gap_s = min(state.silent_s[sensor], LONGEST_GAP_S)
    state.silent_s[sensor] = 0.0
    share = 1.0 - np.exp(-gap_s / memory_s)
    nis = state.nis[sensor]
    nis *= 1.0 - share
    for group in range(rows.filled[1]):
        if rows.size[group] == 3:
            nis[rows.source[group]] += share * min(distance[group], LARGEST_DISTANCE)
    for link in range(len(ends)):
        least = np.inf
        for each in range(len(state.silent_s)):
            if state.silent_s[each] < CAMERA_TIMEOUT_S:
                least = min(least, state.nis[each, ends[link]])
        state.adaptation[1 + link] = min(max(np.sqrt(least / adapted_distance), 1.0), most)
        passed_s = gap_s / len(state.silent_s)
        known_s = state.contradicted_s[link]
        is_contradicted = least > CONTRADICTED
        state.contradicted_s[link] = max(
            known_s + (passed_s if is_contradicted else -passed_s), 0.0
        )
    state.adaptation[0] = state.adaptation[1]
