r"""Measurement model of an aligned IMU.

Its orientation :math:`R_{ws}` is relative to its own reference frame, whose heading in map is ψ. It
measures the link's rotation through the sensor-to-segment rotation M, and its gyroscope measures
the link's rate:

.. math:: R_z(\psi)\,R_{ws}\,M = \exp(n)\,R_l, \quad R_z(\psi)\,R_{ws}\,\omega_s = \omega_l + n

With :math:`Q = R_z(\hat\psi) R_{ws} \hat M` the residual :math:`\log(Q \hat R_l^T)` is
:math:`\delta\theta_l - e_z\,\delta\psi - Q\,\delta m`: the link's error turns in map,
:math:`R = \exp(\delta\theta) \hat R`, the sensor-to-segment rotation's in the link,
:math:`M = \hat M \exp(\delta m)`. The noise n is independent about the link's axes, of the
orientation with Student's t, of the rate normal. Pelvis and trunk, which bend forward within
themselves, differ from their IMU about the lateral axis.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pose_core.arrays import FloatArray
from pose_core.filter.layout import rate_column, rotation_column
from pose_core.filter.rows import NORMAL, Rows, add_group
from pose_core.filter.state import FilterState
from pose_core.kernels.compiling import compiled_into_caller
from pose_core.kernels.rotations import exponential, logarithm, product, product_transposed

MAX_SOFT_TISSUE_RATE = 6.0  # [rad/s] above which the soft-tissue error does not grow further
RATE_NOISE_GROWTH = 0.5  # [s] of the gyroscope's noise with its rate: a segment is not rigid
HELD_JERK = 100.0  # [rad/s³] half that of a swinging limb while its sample is extrapolated


class ImuConstants(NamedTuple):
    """Parameters of :class:`pose_core.filter.tuning.ImuNoise`."""

    stddev: FloatArray  # (links, 3) [rad] about the link's axes
    soft_tissue: float  # [s]
    correlated_samples: float  # [-]
    student_dof: float  # [-]
    rate_stddev: FloatArray  # (links, 3) [rad/s] about the link's axes


class ImuFrame(NamedTuple):
    """Samples of k aligned IMUs at one instant."""

    links: NDArray[np.int64]  # (k,)
    R_world_sensor: FloatArray  # (k, 3, 3)
    angular_velocity: FloatArray  # (k, 3) [rad/s] in the sensors' frames
    age_s: FloatArray  # (k,) [s] of extrapolation by the gyroscope
    rate_stddev: FloatArray  # (k,) [rad/s] in addition to that of a gyroscope


NO_IMUS = ImuFrame(
    np.zeros(0, np.int64), np.zeros((0, 3, 3)), np.zeros((0, 3)), np.zeros(0), np.zeros(0)
)


@compiled_into_caller
def add_imu_rows(constants: ImuConstants, state: FilterState, imus: ImuFrame, rows: Rows) -> None:
    """Add three rows for the orientation and three for the rate of each IMU."""
    Q, residual = np.empty((3, 3)), np.empty(6)
    for row in range(len(imus.links)):
        link = imus.links[row]
        rotation, rate = rotation_column(link), rate_column(state.layout, link)
        column, age_s = state.imus.column[link], imus.age_s[row]
        speed = min(imu_residual(state, imus, row, Q, residual), MAX_SOFT_TISSUE_RATE)
        factor = state.imus.noise[link]
        held = HELD_JERK * age_s**3 / 3.0
        growth = 1.0 + (RATE_NOISE_GROWTH * speed) ** 2
        held_rate_variance = (HELD_JERK * age_s**2) ** 2 + imus.rate_stddev[row] ** 2
        orientation = add_group(rows, 3, constants.student_dof, link)
        first = rows.first[orientation]
        gyroscope = add_group(rows, 3, NORMAL, link)
        for i in range(3):
            rows.H[first + i, rotation + i] = 1.0
            for k in range(3):
                rows.H[first + i, column + k] = -Q[i, k]
            rows.residual[first + i] = residual[i]
            rows.H[first + 3 + i, rate + i] = 1.0
            rows.residual[first + 3 + i] = residual[3 + i]
        rows.H[first + 2, column + 3] = -1.0
        for axis in range(3):
            stddev = factor * (constants.stddev[link, axis] + constants.soft_tissue * speed)
            variance = constants.correlated_samples * stddev**2 + held**2
            rate_variance = growth * (factor * constants.rate_stddev[link, axis]) ** 2
            rate_variance += held_rate_variance
            for i in range(3):
                for k in range(3):
                    rows.noise[orientation, i, k] += variance * Q[i, axis] * Q[k, axis]
                    rows.noise[gyroscope, i, k] += rate_variance * Q[i, axis] * Q[k, axis]


@compiled_into_caller
def imu_residual(
    state: FilterState, imus: ImuFrame, row: int, Q: FloatArray, out: FloatArray
) -> float:
    """Measured minus predicted orientation and rate of one IMU.

    Args:
        state: The state.
        imus: Samples of all IMUs.
        row: Index of the IMU.
        Q: Filled, (3, 3): the link's rotation as measured by the IMU.
        out: Filled, (6,): rotation vector [rad] and rate [rad/s], in map.

    Returns:
        Magnitude of the measured rate [rad/s].
    """
    link = imus.links[row]
    R_z, R_map_sensor, apart = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    exponential(0.0, 0.0, state.imus.heading[link], R_z)
    product(R_z, imus.R_world_sensor[row], R_map_sensor)
    product(R_map_sensor, state.imus.R_sensor_link[link], Q)
    product_transposed(Q, state.pose.rotations[link], apart)
    logarithm(apart, out[:3])
    rate = np.dot(R_map_sensor, imus.angular_velocity[row])
    for axis in range(3):
        out[3 + axis] = rate[axis] - state.pose.rates[link, axis]
    return float(np.sqrt(rate[0] ** 2 + rate[1] ** 2 + rate[2] ** 2))
