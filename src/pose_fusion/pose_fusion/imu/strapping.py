r"""How crooked an IMU sits on its segment, from free movement: recursive least squares.

The cameras see a segment's long axis, z, and, where a knee or an elbow is bent, its hinge, y. Seen
from the sensor both stand still, so every instant measures the mounting. With the mounting
:math:`M = R_{sensor,segment}`, wrong by a small turn :math:`e`, and the heading wrong by
:math:`\delta`, an axis :math:`a` seen in map appears in the segment as

.. math:: M^T R_{map,sensor}^T a = a_0 + e \times a_0 - \delta\, u \times a_0

where :math:`u` is the vertical there. Long axes measure :math:`e_x, e_y`, hinges :math:`e_z`. Turns
of an upright segment cannot tell :math:`e_z` from :math:`\delta`: the covariance says so, and that
is the measure of what the motion has excited.
"""

import math
from dataclasses import dataclass

import numpy as np

from pose_fusion.body.kinematics import rotation_from_vector
from pose_fusion.imu.heading import AXIS_STDDEV, CORRELATION_S, LIMIT, LONGEST_STEP_S
from pose_fusion.streams.samples import FloatArray

PRIOR_STDDEV = math.radians(30.0)  # [rad] of a mounting taken from a pose nobody has checked
HEADING_STDDEV = math.radians(5.0)  # [rad] of the heading that the sensor's rotation comes with
CAMERA_BIAS = math.radians(2.0)  # [rad] of axes as the cameras see them, which nothing averages out
OBSERVED = math.radians(5.0)  # [rad] stddev below which an axis counts as excited
LONG_AXIS = np.array([0.0, 0.0, 1.0])
LATERAL_AXIS = np.array([0.0, 1.0, 0.0])


@dataclass(frozen=True, kw_only=True)
class Strapping:
    """A mounting, and how well it is known."""

    R_sensor_segment: FloatArray  # (3, 3)
    stddev: FloatArray  # (3,) [rad] about the segment's x, y, z
    residual: float  # [rad] RMS between the axes as seen and as the mounting has them

    @property
    def is_observed(self) -> FloatArray:
        """Whether the motion has excited each of the segment's axes x, y, z, shape (3,)."""
        return np.asarray(self.stddev < OBSERVED)


class StrappingEstimator:
    """Refines one IMU's mounting.

    Args:
        R_sensor_segment: The first guess, from the neutral pose, shape (3, 3).
        stddev: Its standard deviation about every axis [rad].
    """

    def __init__(self, R_sensor_segment: FloatArray, stddev: float = PRIOR_STDDEV) -> None:
        self._mounting = R_sensor_segment.copy()
        self._heading = 0.0  # [rad] error of the heading
        self._covariance = np.diag([stddev**2] * 3 + [HEADING_STDDEV**2])
        self._squares = self._weights = 0.0

    @property
    def result(self) -> Strapping:
        """The mounting as known now."""
        variance = np.diag(self._covariance)[:3]
        return Strapping(
            R_sensor_segment=self._mounting.copy(),
            stddev=np.sqrt(variance + CAMERA_BIAS**2),
            residual=math.sqrt(self._squares / self._weights) if self._weights > 0.0 else math.nan,
        )

    def observe_long_axis(
        self, dt_s: float, R_map_sensor: FloatArray, axis_map: FloatArray
    ) -> None:
        """Take where the cameras see the segment's z axis.

        Args:
            dt_s: Time [s] that this instant stands for.
            R_map_sensor: The sensor's rotation, shape (3, 3).
            axis_map: The z axis in map, shape (3,).
        """
        self._observe(dt_s, R_map_sensor, axis_map, LONG_AXIS, AXIS_STDDEV)

    def observe_lateral_axis(
        self, dt_s: float, R_map_sensor: FloatArray, axis_map: FloatArray, sharpness: float
    ) -> None:
        """Take where the cameras see the segment's y axis, as a bent hinge shows it.

        Args:
            dt_s: Time [s] that this instant stands for.
            R_map_sensor: The sensor's rotation, shape (3, 3).
            axis_map: The y axis in map, shape (3,).
            sharpness: How well it is seen [-]: 1 like a long axis, less in proportion.
        """
        self._observe(dt_s, R_map_sensor, axis_map, LATERAL_AXIS, AXIS_STDDEV / sharpness)

    def _observe(
        self,
        dt_s: float,
        R_map_sensor: FloatArray,
        axis_map: FloatArray,
        axis: FloatArray,
        stddev: float,
    ) -> None:
        dt_s = min(dt_s, LONGEST_STEP_S)
        R_map_segment = R_map_sensor @ self._mounting
        up = R_map_segment[2]
        # The turn from where the axis is thought to where it is seen has no part along the axis.
        across = [0, 1] if axis is LONG_AXIS else [0, 2]
        turn = np.cross(axis, R_map_segment.T @ axis_map)[across]
        H = np.zeros((2, 4))
        H[:, :3] = np.eye(3)[across]
        H[:, 3] = -up[across]
        innovation = turn - H[:, 3] * self._heading
        size = float(np.linalg.norm(innovation))
        self._squares += dt_s * min(size, 2.0 * LIMIT * stddev) ** 2
        self._weights += dt_s
        limit = LIMIT * math.sqrt(stddev**2 + float(np.trace(H @ self._covariance @ H.T)))
        if size > limit:
            innovation *= limit / size
        S = H @ self._covariance @ H.T + np.eye(2) * stddev**2 * CORRELATION_S / dt_s
        gain = np.linalg.solve(S, H @ self._covariance).T
        correction = gain @ innovation
        self._covariance -= gain @ S @ gain.T
        self._mounting = self._mounting @ rotation_from_vector(correction[:3])
        self._heading += float(correction[3])
