"""Camera geometry: joints in map, axes of trunk and segments."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pose_core.kernels.compiling import compiled, compiled_in_place
from pose_core.kernels.vectors import cross, dot, norm
from pose_core.streams.samples import FloatArray

SHORTEST_BONE = 0.01  # [m] joints nearer to each other than that give no direction


class ObservedAxes(NamedTuple):
    """Axes of m segments in map, as unit vectors; NaN where the cameras do not observe one."""

    long: FloatArray  # (m, 3) z
    lateral: FloatArray  # (m, 3) y
    sharpness: FloatArray  # (m,) [-] of y, relative to a long axis (1)


class AxisArrays(NamedTuple):
    """The joints that define the axes of n segments."""

    ends: NDArray[np.int64]  # (n, 2) joints of the long axis
    direction: FloatArray  # (n,) ±1 of z from the first to the second; 0: the trunk's z
    lines: NDArray[np.int64]  # (n, 2) joints of the lateral axis, right and left; −1: none
    hinges: NDArray[np.int64]  # (n, 4) joints of the bones above and below a hinge; −1: none
    hinge_direction: FloatArray  # (n, 3) ±1 of z along either bone, and of y along the axis


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
        observed_state[j] = state[j] if np.isfinite(positions_map[j, 0]) else 0


@compiled_in_place
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


@compiled_in_place
def normalise(v: FloatArray) -> None:
    """Divide a vector by its length."""
    length = norm(v)
    for axis in range(3):
        v[axis] /= length


@compiled
def observe_axes(
    axes: AxisArrays,
    rows: NDArray[np.int64],
    joints: FloatArray,
    trunk: FloatArray,
    least_bend: float,
    hinge_sharpness: float,
    out: ObservedAxes,
) -> None:
    """Compute the axes of some segments from joint positions.

    Args:
        axes: The segments' axes.
        rows: Indices of the segments, (m,); −1: a segment without axes.
        joints: In map, (15, 3) [m]; NaN where not observed.
        trunk: The trunk's axes in map, (3, 3).
        least_bend: Sine of the flexion below which a hinge defines no axis.
        hinge_sharpness: Sharpness of a hinge at a right angle [-]; proportional to the sine.
        out: Filled, m rows.
    """
    upper, lower = np.empty(3), np.empty(3)
    for m in range(len(rows)):
        row, long, lateral = rows[m], out.long[m], out.lateral[m]
        long[:], lateral[:], out.sharpness[m] = np.nan, np.nan, 0.0
        if row < 0:
            continue
        if axes.direction[row] == 0.0:
            long[:] = trunk[:, 2]
        else:
            start, end = axes.ends[row]
            bone_axis(joints[start], joints[end], axes.direction[row], long)
        if axes.lines[row, 0] >= 0:
            right, left = axes.lines[row]
            bone_axis(joints[right], joints[left], 1.0, lateral)
            out.sharpness[m] = 1.0
        if axes.hinges[row, 0] >= 0:
            first, second, third, fourth = axes.hinges[row]
            bone_axis(joints[first], joints[second], axes.hinge_direction[row, 0], upper)
            bone_axis(joints[third], joints[fourth], axes.hinge_direction[row, 1], lower)
            cross(upper, lower, lateral)
            sine = norm(lateral)
            out.sharpness[m] = hinge_sharpness * sine
            for axis in range(3):
                lateral[axis] *= axes.hinge_direction[row, 2] / sine
            if not sine > least_bend:
                lateral[:] = np.nan


@compiled_in_place
def bone_axis(start: FloatArray, end: FloatArray, direction: float, out: FloatArray) -> None:
    """Unit vector from one joint to another; NaN if unobserved or closer than SHORTEST_BONE."""
    x, y, z = end[0] - start[0], end[1] - start[1], end[2] - start[2]
    length = np.sqrt(x * x + y * y + z * z)
    scale = direction / length if length > SHORTEST_BONE else np.nan  # NaN of NaN
    out[0], out[1], out[2] = x * scale, y * scale, z * scale
