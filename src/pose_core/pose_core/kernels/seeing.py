"""What cameras see: joints in map, their mean over cameras, the trunk's and the segments' axes."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pose_core.kernels.alignment import Sights
from pose_core.kernels.compiling import compiled, compiled_in_place
from pose_core.kernels.vectors import cross, dot, norm
from pose_core.streams.samples import FloatArray

SHORTEST_BONE = 0.01  # [m] joints nearer to each other than that give no direction
TRACKED = 2  # of TrackingState


class AxisNumbers(NamedTuple):
    """Which joints show the axes of n segments."""

    ends: NDArray[np.int64]  # (n, 2) joints of the long axis
    direction: FloatArray  # (n,) ±1 of z from the first to the second; 0: the trunk's z
    lines: NDArray[np.int64]  # (n, 2) joints of the lateral axis, right and left; −1: none
    hinges: NDArray[np.int64]  # (n, 4) joints of the bones above and below a hinge; −1: none
    hinge_direction: FloatArray  # (n, 3) ±1 of z along either bone, and of y along the axis


@compiled_in_place
def into_map(
    T_map_sensor: FloatArray,
    positions: FloatArray,
    state: NDArray[np.uint8],
    positions_map: FloatArray,
    state_seen: NDArray[np.uint8],
) -> None:
    """One camera's joints, (15, 3) [m], in map, and the states of those that it sees."""
    for j in range(len(positions)):
        for i in range(3):
            positions_map[j, i] = T_map_sensor[i, 3]
            for k in range(3):
                positions_map[j, i] += T_map_sensor[i, k] * positions[j, k]
        state_seen[j] = state[j] if np.isfinite(positions_map[j, 0]) else 0


@compiled_in_place
def keep_latest(
    stamp_ns: int,
    is_present: NDArray[np.bool_],
    positions: FloatArray,
    tracking_state: NDArray[np.uint8],
    longest_ns: int,
    latest: FloatArray,
    latest_ns: NDArray[np.int64],
) -> None:
    """Remember what each camera's tracker tracked last, a short while ago at most.

    Args:
        stamp_ns: The instant.
        is_present: Which cameras speak of it, (s,).
        positions: Their joints in map, (s, 15, 3) [m].
        tracking_state: Their joints' states, (s, 15).
        longest_ns: How long what a camera saw is remembered [ns].
        latest: What is remembered, (s, 15, 3) [m]; NaN: nothing.
        latest_ns: Of when that is, (s,).
    """
    for s in range(len(latest)):
        if is_present[s]:
            for j in range(latest.shape[1]):
                is_tracked = tracking_state[s, j] == TRACKED
                for axis in range(3):
                    latest[s, j, axis] = positions[s, j, axis] if is_tracked else np.nan
            latest_ns[s] = stamp_ns
        elif abs(stamp_ns - latest_ns[s]) > longest_ns:
            for j in range(latest.shape[1]):
                for axis in range(3):
                    latest[s, j, axis] = np.nan


@compiled_in_place
def share_cameras(tracking_state: NDArray[np.uint8], out: FloatArray) -> None:
    """Each camera's share [-] in each joint, (s, 15): by how well its tracker has it."""
    for j in range(out.shape[1]):
        total = 0
        for s in range(len(out)):
            total += tracking_state[s, j]
        for s in range(len(out)):
            out[s, j] = tracking_state[s, j] / total if total > 0 else 0.0


@compiled_in_place
def mean_of_cameras(positions: FloatArray, out: FloatArray) -> None:
    """Mean of the cameras that saw a joint, (s, 15, 3) to (15, 3) [m]; NaN if none did."""
    for j in range(len(out)):
        for axis in range(3):
            total, count = 0.0, 0
            for s in range(len(positions)):
                if np.isfinite(positions[s, j, axis]):
                    total += positions[s, j, axis]
                    count += 1
            out[j, axis] = total / count if count > 0 else np.nan


@compiled
def mean_without_offsets(
    positions: FloatArray,
    offsets: FloatArray,
    hips_and_neck: NDArray[np.int64],
    out: FloatArray,
) -> None:
    """The same less the trackers' offsets, (s, 15, 3) [m] in axes that turn with the trunk."""
    mean_of_cameras(positions, out)
    trunk = np.empty((3, 3))
    trunk_of(out, hips_and_neck, trunk)
    length = np.hypot(trunk[0, 0], trunk[1, 0])
    c, s = trunk[0, 0] / length, trunk[1, 0] / length
    if np.isnan(c) or not np.any(offsets):
        return
    moved = np.empty_like(positions)
    for k in range(len(positions)):
        for j in range(len(out)):
            x, y, z = offsets[k, j]
            moved[k, j, 0] = positions[k, j, 0] - (c * x - s * y)
            moved[k, j, 1] = positions[k, j, 1] - (s * x + c * y)
            moved[k, j, 2] = positions[k, j, 2] - z
    mean_of_cameras(moved, out)


@compiled_in_place
def trunk_of(joints: FloatArray, hips_and_neck: NDArray[np.int64], out: FloatArray) -> None:
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
def trunks_of(joints: FloatArray, hips_and_neck: NDArray[np.int64], out: FloatArray) -> None:
    """The trunk's axes at many instants, (n, 15, 3) to (n, 3, 3)."""
    for row in range(len(joints)):
        trunk_of(joints[row], hips_and_neck, out[row])


@compiled_in_place
def normalise(v: FloatArray) -> None:
    """Divide a vector by its length."""
    length = norm(v)
    for axis in range(3):
        v[axis] /= length


@compiled
def see_axes(
    numbers: AxisNumbers,
    rows: NDArray[np.int64],
    joints: FloatArray,
    trunk: FloatArray,
    least_bend: float,
    hinge_sharpness: float,
    out: Sights,
) -> None:
    """The axes of some segments.

    Args:
        numbers: The segments.
        rows: Which of them, (m,); −1: one that shows none.
        joints: In map, (15, 3) [m]; NaN unseen.
        trunk: The trunk's axes in map, (3, 3).
        least_bend: Sine of the angle below which a hinge shows no axis.
        hinge_sharpness: Of a hinge at a right angle [-]; less in proportion to its sine.
        out: Filled, m rows.
    """
    upper, lower = np.empty(3), np.empty(3)
    for m in range(len(rows)):
        row, long, lateral = rows[m], out.long[m], out.lateral[m]
        long[:], lateral[:], out.sharpness[m] = np.nan, np.nan, 0.0
        if row < 0:
            continue
        if numbers.direction[row] == 0.0:
            long[:] = trunk[:, 2]
        else:
            start, end = numbers.ends[row]
            bone_axis(joints[start], joints[end], numbers.direction[row], long)
        if numbers.lines[row, 0] >= 0:
            right, left = numbers.lines[row]
            bone_axis(joints[right], joints[left], 1.0, lateral)
            out.sharpness[m] = 1.0
        if numbers.hinges[row, 0] >= 0:
            first, second, third, fourth = numbers.hinges[row]
            bone_axis(joints[first], joints[second], numbers.hinge_direction[row, 0], upper)
            bone_axis(joints[third], joints[fourth], numbers.hinge_direction[row, 1], lower)
            cross(upper, lower, lateral)
            sine = norm(lateral)
            out.sharpness[m] = hinge_sharpness * sine
            for axis in range(3):
                lateral[axis] *= numbers.hinge_direction[row, 2] / sine
            if not sine > least_bend:
                lateral[:] = np.nan


@compiled_in_place
def bone_axis(start: FloatArray, end: FloatArray, direction: float, out: FloatArray) -> None:
    """The unit vector from a joint to another; NaN where they are not seen or lie together."""
    x, y, z = end[0] - start[0], end[1] - start[1], end[2] - start[2]
    length = np.sqrt(x * x + y * y + z * z)
    scale = direction / length if length > SHORTEST_BONE else np.nan  # NaN of NaN
    out[0], out[1], out[2] = x * scale, y * scale, z * scale
