"""Camera geometry: joints in map, axes of the trunk."""

import numpy as np
from numpy.typing import NDArray

from pose_core.arrays import FloatArray
from pose_core.joints import TrackingState
from pose_core.kernels.compiling import compiled_in_place, compiled_into_caller
from pose_core.kernels.linear_algebra import cross, dot, norm


@compiled_in_place
def transform_to_map(
    T_map_sensor: FloatArray,
    positions: FloatArray,
    state: NDArray[np.uint8],
    positions_map: FloatArray,
    observed_state: NDArray[np.uint8],
) -> None:
    """Transform one camera's joints, (15, 3) [m], to map; a joint that is NaN is not tracked."""
    for j in range(len(positions)):
        for i in range(3):
            positions_map[j, i] = T_map_sensor[i, 3]
            for k in range(3):
                positions_map[j, i] += T_map_sensor[i, k] * positions[j, k]
        is_known = np.isfinite(positions_map[j, 0])
        observed_state[j] = state[j] if is_known else np.uint8(TrackingState.NOT_TRACKED)


@compiled_into_caller
def compute_trunk_axes(
    joints: FloatArray, hips_and_neck: NDArray[np.int64], out: FloatArray
) -> None:
    """The trunk's axes as columns; see :func:`pose_core.body.trunk.trunk_axes`."""
    left, right, neck = joints[hips_and_neck[0]], joints[hips_and_neck[1]], joints[hips_and_neck[2]]
    for axis in range(3):
        out[axis, 1] = left[axis] - right[axis]
        out[axis, 2] = neck[axis] - 0.5 * (left[axis] + right[axis])
    x, y, z = out[:, 0], out[:, 1], out[:, 2]
    normalise(y)
    along = dot(z, y)
    for axis in range(3):
        z[axis] -= along * y[axis]
    normalise(z)
    cross(y, z, x)


@compiled_in_place
def compute_trunk_axes_batch(
    joints: FloatArray, hips_and_neck: NDArray[np.int64], out: FloatArray
) -> None:
    """The trunk's axes at many instants, (n, 15, 3) to (n, 3, 3)."""
    for row in range(len(joints)):
        compute_trunk_axes(joints[row], hips_and_neck, out[row])


@compiled_into_caller
def normalise(v: FloatArray) -> None:
    """Divide a vector by its length."""
    length = norm(v)
    for axis in range(3):
        v[axis] /= length
