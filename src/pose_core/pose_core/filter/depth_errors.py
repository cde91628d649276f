r"""Errors of a view along its rays: a camera knows distances less well than directions.

Trackers that find joints in the image and guess or look up their distance err along the ray
from the camera to the joint, with the direction u, more than across it:

.. math:: z_j = p_j + (d + e_j)\,u_j + \dots

d is an error of the whole body that all joints of a frame share. It is estimated for each view,
outside the state, as a process that decays within :data:`MEMORY_S` and has the mean square that
its estimates show. The :math:`e_j` are independent noise; its variance is the mean difference of
the squared residuals along and across the rays. Both are small for depth cameras with a body
model, and several centimetres for trackers on images. They are learnt while another camera sends
frames: of a single one, they cannot be distinguished from motion.

Such errors last, and limbs err alike, which the covariance does not know; so both also scale the
published variances (:func:`depth_variance_scale`).
"""

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.filter.frame import FrameUpdate
from pose_core.filter.rows import Rows
from pose_core.filter.state import FilterState, another_camera_sends
from pose_core.kernels.compiling import compiled_in_place, compiled_into_caller

MEMORY_S = 1.0  # [s] time constant with which d decays
POWER_MEMORY_S = 10.0  # [s] over which its mean square is estimated
MIN_VARIANCE = 0.005**2  # [m²] of d
NOISE_MEMORY_S = 3.0  # [s] over which the noise along the rays is estimated
USUAL_VARIANCE = 0.02**2  # [m²] of depth cameras with a body model, mean of d² + NOISE_SHARE e²
NOISE_SHARE = 0.25  # [-]
LARGE_VARIANCE = 0.06**2  # [m²] above the usual one, with half of the largest effect
MAX_EXCESS = 3.0  # [-] of the published variances


@compiled_in_place
def predict_depth_errors(dt_s: float, state: FilterState) -> None:
    """Advance the views' errors by ``dt_s`` [s]."""
    keep = np.exp(-dt_s / MEMORY_S)
    for sensor in range(len(state.views.depth_error)):
        renewed = (1.0 - keep**2) * state.views.depth_error_power[sensor]
        state.views.depth_error[sensor] *= keep
        state.views.depth_error_variance[sensor] *= keep**2
        state.views.depth_error_variance[sensor] += renewed


@compiled_into_caller
def ray_to(position: FloatArray, camera: FloatArray) -> tuple[float, float, float]:
    """Direction from a camera to a position."""
    x, y, z = position[0] - camera[0], position[1] - camera[1], position[2] - camera[2]
    length = max(np.sqrt(x * x + y * y + z * z), 1e-6)
    return x / length, y / length, z / length


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
    ray = ray_to(predicted, camera)
    common = np.sqrt(state.views.depth_error_variance[sensor])
    for i in range(3):
        rows.residual[first + i] -= ray[i] * state.views.depth_error[sensor]
        rows.common[first + i] = ray[i] * common
        for k in range(3):
            noise[i, k] += ray[i] * ray[k] * state.views.depth_noise[sensor]


@compiled_into_caller
def estimate_depth_errors(update: FrameUpdate, state: FilterState) -> None:
    """Update a view's errors with one frame, and remove the common one from its residuals."""
    sensor, gap_s, result = update.frame.sensor, update.gap_s, update.result
    rows, measured = update.rows, 3 * update.joint_count
    rows.residual[:measured] -= result.common_error * rows.common[:measured]
    variance, power = (
        state.views.depth_error_variance[sensor],
        state.views.depth_error_power[sensor],
    )
    state.views.depth_error[sensor] += np.sqrt(variance) * result.common_error
    state.views.depth_error_variance[sensor] = variance * result.common_variance
    if measured == 0 or not another_camera_sends(state, sensor):
        return
    squared = state.views.depth_error[sensor] ** 2 + state.views.depth_error_variance[sensor]
    power += (1.0 - np.exp(-gap_s / POWER_MEMORY_S)) * (squared - power)
    state.views.depth_error_power[sensor] = max(power, MIN_VARIANCE)
    share = 1.0 - np.exp(-gap_s / NOISE_MEMORY_S)
    excess = noise_along_rays(update)
    noise = state.views.depth_noise[sensor]
    state.views.depth_noise[sensor] = max(noise + share * (excess - noise), 0.0)


@compiled_in_place
def noise_along_rays(update: FrameUpdate) -> float:
    """Weighted mean difference [m²] of a frame's noise along and across the rays.

    Of a residual's square, the part of the prediction's covariance is subtracted.
    """
    rows, result, positions = update.rows, update.result, update.predicted.positions
    sum_, weights = 0.0, 0.0
    for group in range(update.joint_count):
        first, ray = rows.first[group], ray_to(positions[rows.source[group]], update.frame.camera)
        along, noise, along_P = 0.0, 0.0, 0.0
        for i in range(3):
            r = rows.residual[first + i]
            along += ray[i] * r
            noise += r * r - result.HPHt[first + i, first + i]
            for k in range(3):
                row, column = first + min(i, k), first + max(i, k)  # of the upper triangle
                along_P += ray[i] * ray[k] * result.HPHt[row, column]
        noise_along = along * along - along_P
        sum_ += result.weights[group] * (noise_along - 0.5 * (noise - noise_along))
        weights += result.weights[group]
    return sum_ / weights


@compiled_in_place
def depth_variance_scale(depth_error_power: FloatArray, depth_noise: FloatArray) -> float:
    """Factor [-] of the published variances for the views' errors along the rays.

    Args:
        depth_error_power: Mean square of each view's shared error, (sensors,) [m²].
        depth_noise: Variance of each view's noise along the rays, (sensors,) [m²].
    """
    total = 0.0
    for sensor in range(len(depth_noise)):
        total += depth_error_power[sensor] + NOISE_SHARE * depth_noise[sensor]
    excess = max(total / len(depth_noise) - USUAL_VARIANCE, 0.0)
    return 1.0 + MAX_EXCESS * excess / (excess + LARGE_VARIANCE)
