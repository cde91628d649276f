"""How IMUs sit on their segments: learning from what cameras see, and reading the segments."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pose_core.kernels.anchors import Y0, Anchors, Y, is_known, own_covariance
from pose_core.kernels.compiling import compiled
from pose_core.kernels.heading import observe_lean, observe_turned, predict
from pose_core.kernels.imu import read_segment
from pose_core.streams.samples import FloatArray


class Mountings(NamedTuple):
    """How n IMUs sit; see :mod:`pose_core.imu.alignment`."""

    R_world_sensor_neutral: FloatArray  # (n, 3, 3); NaN: not known yet
    body_heading: FloatArray  # (n,) [rad] in map, while the pose was neutral


class Sights(NamedTuple):
    """What the cameras see of m segments' axes in map; NaN where they do not."""

    long: FloatArray  # (m, 3) z
    lateral: FloatArray  # (m, 3) y
    sharpness: FloatArray  # (m,) [-] of y, 1 like a long axis


@compiled
def is_mounted(mounted: Mountings, i: int) -> bool:
    """Whether an IMU's mounting is known."""
    return not np.isnan(mounted.R_world_sensor_neutral[i, 0, 0])


@compiled
def advance(anchors: Anchors, dt_s: float) -> None:
    """Let all headings drift on."""
    for i in range(len(anchors.state)):
        predict(anchors, i, dt_s)


@compiled
def observe(
    anchors: Anchors,
    mounted: Mountings,
    rows: NDArray[np.int64],
    dt_s: float,
    R_world_sensor: FloatArray,
    sights: Sights,
) -> bool:
    """Compare where the IMUs and the cameras see the segments' axes.

    Args:
        anchors: The IMUs' headings.
        mounted: The IMUs' mountings.
        rows: Which IMUs, (m,).
        dt_s: Time [s] that this instant stands for.
        R_world_sensor: Their readings, (m, 3, 3).
        sights: Their segments' axes.

    Returns:
        Whether the heading of any of them is not known yet though its mounting is.
    """
    axis, turned = np.empty(3), np.empty(3)
    is_any_unknown = False
    for m in range(len(rows)):
        i = rows[m]
        if not is_mounted(mounted, i):
            continue
        R, neutral = R_world_sensor[m], mounted.R_world_sensor_neutral[i]
        into_world(R, neutral, 0.0, 0.0, 1.0, axis)
        observe_lean(anchors, i, dt_s, axis, sights.long[m])
        if is_known(anchors, i) or anchors.is_mounting_known[i]:
            y0 = 0.0 if anchors.is_mounting_known[i] else anchors.state[i, Y0]
            turn = mounted.body_heading[i] - y0
            into_world(R, neutral, -np.sin(turn), np.cos(turn), 0.0, turned)
            observe_turned(anchors, i, dt_s, turned, sights.lateral[m], sights.sharpness[m])
        is_any_unknown |= not is_known(anchors, i)
    return is_any_unknown


@compiled
def into_world(
    R: FloatArray, neutral: FloatArray, x: float, y: float, z: float, out: FloatArray
) -> None:
    """R (neutralᵀ v): an axis of the neutral pose's world as the IMU sees it now."""
    for k in range(3):
        out[k] = 0.0
    for j in range(3):
        in_sensor = neutral[0, j] * x + neutral[1, j] * y + neutral[2, j] * z
        for k in range(3):
            out[k] += R[k, j] * in_sensor


@compiled
def read_all(
    anchors: Anchors,
    mounted: Mountings,
    rows: NDArray[np.int64],
    R_world_sensor: FloatArray,
    angular_velocity: FloatArray,
    sensor_stddev: FloatArray,
    R_map_segment: FloatArray,
    rate_map: FloatArray,
    stddev: FloatArray,
) -> NDArray[np.int64]:
    """What IMUs say of their segments; those come first that are aligned.

    Args:
        anchors: The IMUs' headings.
        mounted: The IMUs' mountings.
        rows: Which IMUs, (m,).
        R_world_sensor: Their readings, (m, 3, 3).
        angular_velocity: Likewise, (m, 3) [rad/s] in the sensor.
        sensor_stddev: Likewise, (m, 3) [rad].
        R_map_segment: Filled, (m, 3, 3).
        rate_map: Filled, (m, 3) [rad/s] in map.
        stddev: Filled, (m, 3) [rad] about map's axes.

    Returns:
        Which of the m are aligned.
    """
    aligned, count = np.empty(len(rows), np.int64), 0
    for m in range(len(rows)):
        i = rows[m]
        if not is_mounted(mounted, i) or not is_known(anchors, i):
            continue
        y0 = 0.0 if anchors.is_mounting_known[i] else anchors.state[i, Y0]
        read_segment(
            R_world_sensor[m],
            mounted.R_world_sensor_neutral[i],
            angular_velocity[m],
            anchors.state[i, Y],
            mounted.body_heading[i] - y0,
            R_map_segment[count],
            rate_map[count],
        )
        stddev[count] = sensor_stddev[m]  # its tilt's, and in place of its north's the heading's
        stddev[count, 2] = np.sqrt(own_covariance(anchors, i)[Y, Y])
        aligned[count] = m
        count += 1
    return aligned[:count]
