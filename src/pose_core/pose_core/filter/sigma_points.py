r"""The unscented transform of a joint's position.

A joint's position is a sum over the links that carry it,
:math:`p = p_0 + \sum_l \exp(\theta_l)\,v_l`, with :math:`v_l` the lever arms and :math:`\theta` the
n errors of the rotations, jointly normal with covariance :math:`\Sigma`. Only these enter
nonlinearly, so the sigma points are spread over them: :math:`\pm\sqrt{c}\,L_i` with
:math:`\Sigma = L L^T` and :math:`c = \alpha^2 n`. By Rodrigues' formula a point and its opposite
are mapped to :math:`e_i \pm s_i` relative to the centre, with

.. math:: s_i = \sum_l \frac{\sin|\theta|}{|\theta|}\,\theta \times v_l, \quad
          e_i = \sum_l \frac{1 - \cos|\theta|}{|\theta|^2}\,\theta \times (\theta \times v_l)

and the statistical linear regression through all points is

.. math:: m = \frac{1}{c} \sum_i e_i, \quad H \sqrt{c}\,L_i = s_i, \quad
          \Omega = \frac{1}{c} \sum_i e_i e_i^T + (\beta - \alpha^2)\, m\,m^T

m is the shift of the mean from the centre. Ω is the residual covariance of the regression, which
is added to the measurement noise. For one joint, an update with m, H and Ω is the
unscented update; between joints, the correlation of Ω is neglected.

References:
    Julier, Uhlmann (2004), Unscented filtering and nonlinear estimation, Proceedings IEEE 92(3).
    Hertzberg, Wagner, Frese, Schröder (2013), Integrating generic sensor fusion algorithms with
    sound state representations through encapsulation of manifolds, Information Fusion 14(1).
    Lefebvre, Bruyninckx, De Schutter (2002), Comment on "A new method for the nonlinear
    transformation of means and covariances", IEEE TAC 47(8): the regression.
    Morelande, Moran (2007), An unscented transformation for conditionally linear models, ICASSP:
    spreading the sigma points only over the nonlinear part.
"""

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.filter.layout import rotation_column
from pose_core.kernels.cholesky import factorise
from pose_core.kernels.compiling import compiled_into_caller
from pose_core.kernels.joint_kinematics import BodyArrays
from pose_core.kernels.rotations import rodrigues

ALPHA = 0.1  # [-] spread of the points in units of √n standard deviations
BETA = 2.0  # [-] best for a normal distribution


@compiled_into_caller
def linearise_joint(
    body: BodyArrays,
    joint: int,
    levers: FloatArray,
    P: FloatArray,
    H: FloatArray,
    shift: FloatArray,
    noise: FloatArray,
) -> None:
    """Linearise one joint's position in the rotations of the links that carry it.

    Args:
        body: The kinematic tree.
        joint: Index of the joint.
        levers: Lever arm of each link to each joint, (joints, links, 3) [m] in map.
        P: Covariance of the error, (n, n).
        H: Jacobian, (3, n); the columns of the links' rotations are filled.
        shift: Filled with m, (3,) [m].
        noise: Measurement covariance, (3, 3) [m²]; Ω is added.
    """
    carriers, count = body.carriers[joint], body.carrier_count[joint]
    size = 3 * count
    c = ALPHA**2 * size
    factor, slopes, bend = np.empty((size, size)), np.zeros((size, 3)), np.empty(3)
    for i in range(size):
        for k in range(size):
            row = rotation_column(carriers[i // 3]) + i % 3
            column = rotation_column(carriers[k // 3]) + k % 3
            factor[i, k] = c * P[row, column]
    factorise(factor)  # its rows, from the diagonal on, are the points
    shift[:] = 0.0
    for i in range(size):
        bend[:] = 0.0
        for each in range(i // 3, count):
            at = 3 * each
            x = factor[i, at] if at >= i else 0.0
            y = factor[i, at + 1] if at + 1 >= i else 0.0
            z = factor[i, at + 2]
            v = levers[joint, carriers[each]]
            first, second = rodrigues(x * x + y * y + z * z)
            u0, u1, u2 = y * v[2] - z * v[1], z * v[0] - x * v[2], x * v[1] - y * v[0]
            slopes[i, 0] += first * u0
            slopes[i, 1] += first * u1
            slopes[i, 2] += first * u2
            bend[0] += second * (y * u2 - z * u1)
            bend[1] += second * (z * u0 - x * u2)
            bend[2] += second * (x * u1 - y * u0)
        for axis in range(3):
            shift[axis] += bend[axis] / c
            for k in range(3):
                noise[axis, k] += bend[axis] * bend[k] / c
    for axis in range(3):
        for k in range(3):
            noise[axis, k] += (BETA - ALPHA**2) * shift[axis] * shift[k]
    for i in range(size - 1, -1, -1):
        for axis in range(3):
            total = slopes[i, axis]
            for k in range(i + 1, size):
                total -= factor[i, k] * slopes[k, axis]
            slopes[i, axis] = total / factor[i, i]
            H[axis, rotation_column(carriers[i // 3]) + i % 3] = slopes[i, axis]
