r"""Errors of a view along its rays: a camera knows distances less well than directions.

Trackers that find joints in the image and guess or look up their distance err along the ray
from the camera to the joint, with the direction u, more than across it:

.. math:: z_j = p_j + (d + e_j)\,u_j + \dots

d is an error of the whole body that all joints of a frame share. It is estimated for each view,
outside the state, as a process that decays within :data:`MEMORY_S` and has the mean square that
its estimates show. The :math:`e_j` are independent noise; its variance is the mean difference of
the squared residuals along and across the rays. Both are small for depth cameras with a body
model, and several centimetres for trackers on images. They are learnt while another camera sends
frames: of a single one, they cannot be told from motion.
"""

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.filter.rows import Rows
from pose_core.filter.state import FilterState, another_camera_sends
from pose_core.filter.update import UpdateResult
from pose_core.kernels.compiling import compiled, compiled_in_place

MEMORY_S = 1.0  # [s] time constant with which d decays
LEARNING_S = 10.0  # [s] over which its mean square is estimated
LEAST_VARIANCE = 0.005**2  # [m²] of d
NOISE_LEARNING_S = 3.0  # [s] over which the noise along the rays is estimated


@compiled_in_place
def predict_depth_errors(dt_s: float, state: FilterState) -> None:
    """Advance the views' errors by ``dt_s`` [s]."""
    keep = np.exp(-dt_s / MEMORY_S)
    for sensor in range(len(state.depth_error)):
        renewed = (1.0 - keep**2) * state.depth_error_power[sensor]
        state.depth_error[sensor] *= keep
        state.depth_error_variance[sensor] *= keep**2
        state.depth_error_variance[sensor] += renewed


@compiled_in_place
def add_depth_error(
    state: FilterState, sensor: int, predicted: FloatArray, camera: FloatArray, rows: Rows
) -> None:
    """Add the errors along the ray to the measurement of a joint, the last group of the rows.

    Args:
        state: The state.
        sensor: The camera.
        predicted: Position of the joint in map, (3,) [m].
        camera: Position of the camera in map, (3,) [m].
        rows: Measurement rows.
    """
    group = rows.filled[1] - 1
    first, noise = rows.first[group], rows.noise[group]
    x, y, z = predicted[0] - camera[0], predicted[1] - camera[1], predicted[2] - camera[2]
    length = max(np.sqrt(x * x + y * y + z * z), 1e-6)
    ray = (x / length, y / length, z / length)
    shared = np.sqrt(state.depth_error_variance[sensor])
    for i in range(3):
        rows.residual[first + i] -= ray[i] * state.depth_error[sensor]
        rows.shared[first + i] = ray[i] * shared
        for k in range(3):
            noise[i, k] += ray[i] * ray[k] * state.depth_noise[sensor]


@compiled
def estimate_depth_errors(
    gap_s: float,
    sensor: int,
    positions: FloatArray,
    camera: FloatArray,
    rows: Rows,
    joints: int,
    update: UpdateResult,
    state: FilterState,
) -> None:
    """Update a view's errors with one frame, and remove the shared one from its residuals.

    Args:
        gap_s: Time since the camera's last frame [s].
        sensor: The camera.
        positions: Predicted joints in map, (joints, 3) [m].
        camera: Position of the camera in map, (3,) [m].
        rows: Measurement rows with the residuals before the update, those of joints first.
        joints: Number of groups of joints.
        update: Result of the frame's update.
        state: The state; the view's errors are updated.
    """
    rows.residual[: 3 * joints] -= update.shared * rows.shared[: 3 * joints]
    variance, power = state.depth_error_variance[sensor], state.depth_error_power[sensor]
    state.depth_error[sensor] += np.sqrt(variance) * update.shared
    state.depth_error_variance[sensor] = variance * update.shared_variance
    if joints == 0 or not another_camera_sends(state, sensor):
        return
    squared = state.depth_error[sensor] ** 2 + state.depth_error_variance[sensor]
    power += (1.0 - np.exp(-gap_s / LEARNING_S)) * (squared - power)
    state.depth_error_power[sensor] = max(power, LEAST_VARIANCE)
    share = 1.0 - np.exp(-gap_s / NOISE_LEARNING_S)
    excess = noise_along_rays(positions, camera, rows, joints, update)
    noise = state.depth_noise[sensor]
    state.depth_noise[sensor] = max(noise + share * (excess - noise), 0.0)


@compiled
def noise_along_rays(
    positions: FloatArray, camera: FloatArray, rows: Rows, joints: int, update: UpdateResult
) -> float:
    """Weighted mean difference [m²] of a frame's noise along and across the rays.

    Of a residual's square, the part of the prediction's covariance is subtracted.
    """
    sum_, weights = 0.0, 0.0
    for group in range(joints):
        first = rows.first[group]
        own = slice(first, first + 3)
        r, block = rows.residual[own], update.HPHt[own, own]
        ray = positions[rows.source[group]] - camera
        squared = max(np.dot(ray, ray), 1e-12)
        along, whole = np.dot(ray, r) ** 2 / squared, np.dot(r, r)
        for i in range(3):
            whole -= block[i, i]
            along -= ray[i] ** 2 / squared * block[i, i]
            for k in range(i + 1, 3):  # the upper triangle holds the values
                along -= 2.0 * ray[i] * ray[k] / squared * block[i, k]
        sum_ += update.weights[group] * (along - 0.5 * (whole - along))
        weights += update.weights[group]
    return sum_ / weights
