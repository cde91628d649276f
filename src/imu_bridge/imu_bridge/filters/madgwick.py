r"""Orientation of many IMUs by Madgwick's gradient descent: zhang2015 (1), (2).

With :math:`R` the rotation from sensor to world, :math:`\hat a, \hat m` the measured directions of
gravity's reaction and of the magnetic field, and :math:`\hat g = (0, 0, 1)`,
:math:`b = (0, b_y, b_z)` the same two in the world, the filter descends along

.. math:: f(q) = \begin{pmatrix} R^T \hat g - \hat a \\ R^T b - \hat m \end{pmatrix}, \quad
   q_t = q_{t-1} + \left(\dot q_\omega \Delta t - \mu_t \frac{\nabla f}{\|\nabla f\|}\right), \quad
   \mu_t = \beta \Delta t

where :math:`\nabla f` is the gradient of :math:`\tfrac12 \|f\|^2`.

The world is ENU: x east, y magnetic north, z up. Quaternions are (x, y, z, w) for
``R_world_sensor``.

The gradient is computed on the unit sphere, where a rotation by the small rotation vector
:math:`\delta` in sensor axes changes :math:`q` by :math:`\tfrac12 q \otimes (\delta, 0)` and
:math:`R^T v` by :math:`R^T v \times \delta`. Hence with :math:`u = R^T v` predicted and :math:`s`
measured, :math:`\nabla_\delta \tfrac12 \|u - s\|^2 = u \times s`, and (2) becomes one rotation by
:math:`\omega \Delta t - 2 \mu_t \nabla_\delta / \|\nabla_\delta\|`. Madgwick's own four-vector
differs from this by a part along :math:`q`, which the normalisation of :math:`q` removes.

References:
    Zhang, Xu, Sun (2015), J. System Simulation 27(10), equations (1), (2).
    Madgwick, Harrison, Vaidyanathan (2011), ICORR, doi:10.1109/ICORR.2011.5975346.
"""

import numpy as np
from numpy.typing import NDArray

from imu_bridge.filters.conditioned import ConditionedFilter
from imu_bridge.filters.orientation_filter import FilterSettings, SampleRound
from imu_bridge.filters.quaternions import cross, from_rotation_vector, multiply, rotate
from pose_core.arrays import FloatArray

TINY = 1e-12  # [-] smallest norm of a vector with a direction
HALF_TURN = 1e-8  # [-] 2 cos(angle / 2) below which an angle counts as half a turn
PARALLEL_SINE = 1e-3  # [-] below 0.06 deg between field and gravity there is no heading


class MadgwickOrientation(ConditionedFilter):
    """Madgwick's filter with the preprocessing of :class:`ConditionedFilter`.

    A sample without a usable acceleration is integrated by the gyroscope alone; one without a
    usable field, or with one parallel to gravity, corrects the inclination only. The gain ``beta``
    [rad/s] is the rate of the quaternion that the correction may reach; the sensor's orientation is
    corrected by up to twice as much.

    Attributes:
        has_heading: Whether a magnetometer sample has gone into the orientation, shape (n,).
    """

    def __init__(self, count: int, settings: FilterSettings) -> None:
        super().__init__(count, settings)
        self.has_heading: NDArray[np.bool_] = np.zeros(count, dtype=bool)

    def reset(self, index: int) -> None:
        """See :class:`OrientationFilter`."""
        super().reset(index)
        self.has_heading[index] = False

    def _advance(self, samples: SampleRound, rate: FloatArray, field: FloatArray) -> FloatArray:
        index = samples.index
        up, has_up = _directions(samples.acceleration)
        north, has_north = _directions(field)
        has_north &= has_up & (np.linalg.norm(cross(up, north), axis=1) > PARALLEL_SINE)
        q = self.orientation[index]
        fresh = np.isnan(q[:, 3])
        start = fresh & has_up
        # The first usable field sets the heading at once, without descent.
        turn_north = has_north & ~fresh & ~self.has_heading[index]
        if not start.all():
            descend = has_north & ~turn_north
            q = _step(q, samples.dt, rate, up, has_up, north, descend, self._settings.beta)
        if start.any():
            q[start] = initial_orientation(up[start], north[start], has_north[start])
        if turn_north.any():
            q[turn_north] = _turned_north(q[turn_north], north[turn_north])
        self.has_heading[index] |= has_north
        return q


def initial_orientation(up: FloatArray, north: FloatArray, has_north: NDArray) -> FloatArray:
    """Orientation from one sample each: gravity exactly, then the field's heading (TRIAD).

    Args:
        up: Unit specific force in sensor axes, shape (k, 3).
        north: Unit magnetic field in sensor axes, shape (k, 3).
        has_north: Whether ``north`` can be used, shape (k,); otherwise the sensor's
            x axis (y if x is vertical) has no northern component.

    Returns:
        Quaternions (x, y, z, w) of ``R_world_sensor``, shape (k, 4).
    """
    x_upright = np.abs(up[:, 0]) > 0.9
    eastward = np.where(x_upright[:, None], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0])
    north = np.where(has_north[:, None], north, cross(up, eastward))
    # The smallest rotation that turns up into z, about x if that is half a turn.
    q = np.stack([up[:, 1], -up[:, 0], np.zeros(len(up)), 1.0 + up[:, 2]], axis=1)
    q[np.linalg.norm(q, axis=1) < HALF_TURN] = [1.0, 0.0, 0.0, 0.0]
    return _turned_north(q / np.linalg.norm(q, axis=1, keepdims=True), north)


def _turned_north(q: FloatArray, north: FloatArray) -> FloatArray:
    """Rotate about the vertical so that the measured field points north."""
    field = rotate(q, north)
    turn = np.zeros_like(field)
    turn[:, 2] = np.arctan2(field[:, 0], field[:, 1])
    return multiply(from_rotation_vector(turn), q)


def _step(
    q: FloatArray,
    dt: FloatArray,
    angular_velocity: FloatArray,
    up: FloatArray,
    has_up: NDArray,
    north: FloatArray,
    has_north: NDArray,
    beta: float,
) -> FloatArray:
    """One step of (2) for k sensors."""
    # zhang2015 (1), over the whole step: the gyroscope's rotation.
    turn = angular_velocity * dt[:, None]
    predicted_up = rotate(q, np.broadcast_to([0.0, 0.0, 1.0], up.shape), inverse=True)
    gradient = np.where(has_up[:, None], cross(predicted_up, up), 0.0)
    if has_north.any():
        field = rotate(q, north)
        field[:, 1] = np.hypot(field[:, 0], field[:, 1])  # b_y: no correction of inclination
        field[:, 0] = 0.0
        towards = cross(rotate(q, field, inverse=True), north)
        gradient += np.where(has_north[:, None], towards, 0.0)
    norm = np.linalg.norm(gradient, axis=1, keepdims=True)
    mu = beta * dt[:, None]
    # Half the gradient does not overshoot the minimum (the curvature is at most 2): at rest the
    # full step of (2) would oscillate about it by 2 mu.
    step = np.minimum(2.0 * mu, 0.5 * norm)
    turn = turn - step * gradient / np.maximum(norm, TINY)  # zhang2015 (2)
    q = multiply(q, from_rotation_vector(turn))
    return q / np.linalg.norm(q, axis=1, keepdims=True)


def _directions(vectors: FloatArray) -> tuple[FloatArray, NDArray]:
    """Normalise vectors; (0, 0, 0) and False where that is not possible."""
    norm = np.linalg.norm(vectors, axis=1)
    valid = np.isfinite(norm) & (norm > TINY)
    scale = np.where(valid, norm, 1.0)
    return np.where(valid[:, None], vectors, 0.0) / scale[:, None], valid
