r"""Quantities estimated beside the state: views' slow offsets, trackers' delays, process noise.

Two cameras see a joint at places that differ slowly. The difference is estimated as an offset of
each view, by a scalar gain and with a mean of zero over the cameras: what all of them see alike is
the pose's. So the output does not follow the cameras in turn.

A frame's stamp is first taken back by its tracker's delay. Where IMUs measure the rates, what is
left of the delay shows as a residual along the velocity: a robust regression over the bones that
carry an IMU, with a prior at what is known of it.

Where all cameras find a joint farther from its prediction than the covariance allows, the process
noise of its link grows until they agree again.
"""

import numpy as np
from numpy.typing import NDArray

from pose_core.filter.camera import CameraFrame, View, heading_of
from pose_core.filter.rows import Rows
from pose_core.filter.state import FilterState, HEARD_S
from pose_core.kernels.compiling import compiled, compiled_in_place
from pose_core.streams.samples import FloatArray

MOST_DISTANCE = 400.0  # [-] of a squared innovation distance that counts
LONGEST_GAP_S = 0.1  # [s] of a frame, as far as smoothing goes
SHORTEST_DELAY_S, LONGEST_DELAY_S = -0.02, 0.15  # [s] of a tracker
DELAY_GAIN = 1.5  # [-] the pose follows a late camera in part: so much more is left than shows
CONTRADICTED = 25.0  # [-] smoothed NIS that no joint has that is followed


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
    """Take one frame's residuals into the views' offsets.

    Args:
        state: The state; offsets and their variances are updated.
        frame: The frame.
        view: Its prediction.
        rows: Of the update; those of joints come first.
        residual: Before the update, (rows,) [m].
        spread: Diagonal of H P Hᵀ, (rows,) [m²].
        weights: Of the groups, (groups,).
    """
    sensors = len(state.unheard_s)
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
    r"""Update a tracker's delay.

    .. math:: \tau = (\lambda\tau_0 - \sum w\,v \cdot r) / (\lambda + \sum w\,v^2)

    Args:
        starts: First joint of each link, (links,); −1 of the root.
        ends: Last joint of each link, (links,).
        prior: λ [m²/s²].
        known_delay_s: The prior's mean, τ₀ [s].
        memory_s: Time constant of the sums [s].
        state: The state; delay and sums are updated.
        frame: The frame, in time.
        view: Its prediction, for a stamp taken back by the delay so far.
        rows: Of the update, with the residuals before it; those of joints come first.
        weights: Of the groups.
        group_of: Room for the group of each joint, (joints,).
    """
    group_of[:] = -1
    for group in range(rows.filled[1]):
        if rows.size[group] == 3:
            group_of[rows.source[group]] = group
    sums, tau_s = state.delay_sums[frame.sensor], state.delay[frame.sensor]
    keep = np.exp(-min(state.unheard_s[frame.sensor], LONGEST_GAP_S) / memory_s)
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
    """Update the factors of the process noise, and for how long links have been contradicted.

    Args:
        ends: The joint that shows each link, (links,).
        most: Largest factor [-].
        adapted_distance: Smoothed NIS from which the factor grows [-].
        memory_s: Time constant of the smoothing [s].
        state: The state.
        sensor: Whose frame this is.
        rows: Of the update.
        distance: Squared innovation distances of the groups.
    """
    gap_s = min(state.unheard_s[sensor], LONGEST_GAP_S)
    state.unheard_s[sensor] = 0.0
    share = 1.0 - np.exp(-gap_s / memory_s)
    nis = state.nis[sensor]
    nis *= 1.0 - share
    for group in range(rows.filled[1]):
        if rows.size[group] == 3:
            nis[rows.source[group]] += share * min(distance[group], MOST_DISTANCE)
    for link in range(len(ends)):
        least = np.inf
        for each in range(len(state.unheard_s)):
            if state.unheard_s[each] < HEARD_S:
                least = min(least, state.nis[each, ends[link]])
        state.adaptation[1 + link] = min(max(np.sqrt(least / adapted_distance), 1.0), most)
        passed_s = gap_s / len(state.unheard_s)
        known_s = state.contradicted_s[link]
        is_contradicted = least > CONTRADICTED
        state.contradicted_s[link] = max(
            known_s + (passed_s if is_contradicted else -passed_s), 0.0
        )
    state.adaptation[0] = state.adaptation[1]
