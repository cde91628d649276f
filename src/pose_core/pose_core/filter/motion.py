r"""Prediction: rates decay with a time constant and are driven by white accelerations.

.. math:: \dot\omega = -\omega / \tau_\omega + w, \quad
          R(t + \Delta t) = \exp([r\,\omega]_\times) R(t), \quad
          r = \tau_\omega (1 - e^{-\Delta t / \tau_\omega})
"""

from typing import NamedTuple

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.filter.depth_errors import predict_depth_errors
from pose_core.filter.heading_drift import predict_headings
from pose_core.filter.layout import Layout, rotation_column
from pose_core.filter.state import NO_COLUMN, FilterState, Pose
from pose_core.kernels.compiling import compiled, compiled_in_place, compiled_into_caller
from pose_core.kernels.rotations import rotate_left

MAX_STDDEV = 1.2  # [rad] bound of an unobserved rotation's error: the tangent space is local


class MotionConstants(NamedTuple):
    """Process noise of one body."""

    root_power: float  # [m²/s³] spectral density of the root's white acceleration
    power: FloatArray  # (links, links) [rad²/s³] the same of the links', and of each two of them
    rate_memory_s: float
    slide_memory_s: float
    slide_variance: FloatArray  # (slides,) [m²]
    offset_memory_s: float
    offset_variance: float  # [m²]
    alignment_walk: float  # [rad²/s]
    heading_walk: float  # [rad²/s]
    heading_drift_walk: float  # [rad²/s³]


@compiled
def predict(constants: MotionConstants, state: FilterState, dt_s: float) -> None:
    """Advance the state by ``dt_s`` [s], in place."""
    pose, P = state.pose, state.P
    keep, rate_time_s = rate_decay(constants.rate_memory_s, dt_s)
    keep_slide = np.exp(-dt_s / constants.slide_memory_s)
    predict_mean(pose, keep, rate_time_s, keep_slide)
    transform_covariance(P, state.layout, keep, rate_time_s, keep_slide)
    add_process_noise(constants, state, dt_s, keep_slide)
    predict_headings(state, constants.heading_walk, constants.heading_drift_walk, dt_s)
    bound_rotations(P, state.layout)
    keep_offset = np.exp(-dt_s / constants.offset_memory_s)
    predict_depth_errors(dt_s, state)
    state.views.offset[:] *= keep_offset
    state.views.offset_variance[:] *= keep_offset**2
    state.views.offset_variance[:] += (1.0 - keep_offset**2) * constants.offset_variance
    state.views.silent_s[:] += dt_s


@compiled_in_place
def rate_decay(memory_s: float, dt_s: float) -> tuple[float, float]:
    """Share of a rate that is left after ``dt_s`` [s], and the time r that it acts for [s]."""
    keep = np.exp(-dt_s / memory_s)
    return keep, memory_s * (1.0 - keep)


@compiled_in_place
def predict_mean(pose: Pose, keep: float, rate_time_s: float, keep_slide: float) -> None:
    """Advance the mean, in place."""
    for link in range(len(pose.rotations)):
        w = pose.rates[link]
        rotate_left(
            rate_time_s * w[0], rate_time_s * w[1], rate_time_s * w[2], pose.rotations[link]
        )
    for axis in range(3):
        pose.position[axis] += rate_time_s * pose.velocity[axis]
        pose.velocity[axis] *= keep
        for link in range(len(pose.rates)):
            pose.rates[link, axis] *= keep
        for slide in range(len(pose.slides)):
            pose.slides[slide, axis] *= keep_slide


@compiled_in_place
def transform_covariance(
    P: FloatArray, layout: Layout, keep: float, rate_time_s: float, keep_slide: float
) -> None:
    """Replace P by F P Fᵀ."""
    moving, rates, size = layout.first_slide, layout.first_rate, len(P)
    for i in range(moving):
        row, rate = P[i], P[rates + i]
        for k in range(size):
            row[k] += rate_time_s * rate[k]
    for i in range(moving, rates):
        row = P[i]
        for k in range(size):
            row[k] *= keep_slide
    for i in range(rates, rates + moving):
        row = P[i]
        for k in range(size):
            row[k] *= keep
    for k in range(size):
        moved, slid, rate = P[k], P[k, moving:rates], P[k, rates:]
        for i in range(moving):
            moved[i] += rate_time_s * rate[i]
        for i in range(len(slid)):
            slid[i] *= keep_slide
        for i in range(moving):
            rate[i] *= keep


@compiled_in_place
def add_process_noise(
    constants: MotionConstants, state: FilterState, dt_s: float, keep_slide: float
) -> None:
    """Add the process noise Q of one time step to P."""
    P, links = state.P, state.layout.links
    slides, rates = state.layout.first_slide, state.layout.first_rate
    for i in range(slides, rates):
        P[i, i] += constants.slide_variance[(i - slides) // 3] * (1.0 - keep_slide**2)
    add_white_acceleration(P, 0, 0, rates, constants.root_power, dt_s)
    for first in range(links):
        row = rotation_column(first)
        for second in range(links):
            power = constants.power[first, second]
            if power != 0.0:
                add_white_acceleration(P, row, rotation_column(second), rates, power, dt_s)
    for link in range(links):
        own = state.imus.column[link]
        if own != NO_COLUMN:
            for i in range(own, own + 3):
                P[i, i] += constants.alignment_walk * dt_s


@compiled_into_caller
def add_white_acceleration(
    P: FloatArray, row: int, column: int, rates: int, power: float, dt_s: float
) -> None:
    """Add the covariance that white acceleration causes in two vectors and their rates."""
    for axis in range(3):
        i, k = row + axis, column + axis
        P[i, k] += dt_s**3 / 3.0 * power
        P[i, rates + k] += dt_s**2 / 2.0 * power
        P[rates + i, k] += dt_s**2 / 2.0 * power
        P[rates + i, rates + k] += dt_s * power


@compiled_in_place
def bound_rotations(P: FloatArray, layout: Layout) -> None:
    """Scale P so that no rotation's standard deviation exceeds :data:`MAX_STDDEV`."""
    for i in range(3, layout.first_slide):
        if P[i, i] > MAX_STDDEV**2:
            scale = MAX_STDDEV / np.sqrt(P[i, i])
            for k in range(len(P)):
                P[i, k] *= scale
            for k in range(len(P)):
                P[k, i] *= scale
