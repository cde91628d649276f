"""The unscented transform: li2020 (3) to (10), all sigma points at once.

The weights are filterpy's (Van der Merwe 2004). The points and the sums over them are computed with
matrices here, whereas filterpy processes one point at a time.
"""

from dataclasses import dataclass

import numpy as np

from pose_core.arrays import FloatArray

BETA = 2.0  # [-] weight of the centre in the covariance; best for a Gaussian
KAPPA = 0.0  # [-] second scaling


@dataclass(frozen=True, kw_only=True)
class Moments:
    """Mean and covariance of transformed sigma points, and the points' deviations."""

    mean: FloatArray  # (n,)
    covariance: FloatArray  # (n, n), without additive noise
    deviations: FloatArray  # (points, n)


class UnscentedTransform:
    """Sigma points of a Gaussian, and the moments of transformed points.

    Args:
        size: Dimension n of the state; there are 2n + 1 points.
        alpha: Spread [-]: the points lie ``alpha √n`` standard deviations from the mean. The
            customary 1e-3 gives the centre a weight of −10⁶, which cancels digits; 0.1 gives −99,
            and with 96 points of angles still spreads them little enough not to wrap.
    """

    def __init__(self, size: int, *, alpha: float = 0.1) -> None:
        # Imports all of scipy.stats, which takes a second: only when this filter is used.
        from filterpy.kalman import MerweScaledSigmaPoints

        weights = MerweScaledSigmaPoints(size, alpha, BETA, KAPPA)
        self._mean_weights: FloatArray = weights.Wm
        self._covariance_weights: FloatArray = weights.Wc
        self._scale = alpha**2 * (size + KAPPA)  # n + λ

    def sigma_points(self, mean: FloatArray, covariance: FloatArray) -> FloatArray:
        """The points of a Gaussian, shape (2n + 1, n).

        Raises:
            numpy.linalg.LinAlgError: If the covariance is not positive definite.
        """
        from scipy.linalg import cholesky  # loads as long

        # filterpy does this one point at a time.
        spread = cholesky(self._scale * covariance, check_finite=False)
        return np.concatenate([mean[None], mean + spread, mean - spread])

    def moments(self, points: FloatArray) -> Moments:
        """Weighted mean and covariance of points, shape (2n + 1, k)."""
        mean = self._mean_weights @ points  # li2020 (3), (5)
        deviations = points - mean
        covariance = (self._covariance_weights[:, None] * deviations).T @ deviations  # (4), (6)
        return Moments(mean=mean, covariance=covariance, deviations=deviations)

    def cross_covariance(self, state: Moments, measurement: Moments) -> FloatArray:
        """Covariance between state and measurement, shape (n, k)."""
        return (self._covariance_weights[:, None] * state.deviations).T @ measurement.deviations


def kalman_update(
    mean: FloatArray,
    covariance: FloatArray,
    cross_covariance: FloatArray,
    innovation: FloatArray,
    innovation_covariance: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """The Kalman step from moments.

    Args:
        mean: x̂, shape (n,).
        covariance: P̂, shape (n, n).
        cross_covariance: Shape (n, m).
        innovation: y = z − u_z, shape (m,): li2020 (7).
        innovation_covariance: P_z, shape (m, m).

    Returns:
        Updated x, shape (n,), and P, shape (n, n), symmetric.

    Raises:
        numpy.linalg.LinAlgError: If P_z is not positive definite.
    """
    from scipy.linalg import cho_factor, cho_solve  # for this filter's users alone

    factor = cho_factor(innovation_covariance, lower=True)
    gain = cho_solve(factor, cross_covariance.T).T  # li2020 (8)
    updated = covariance - gain @ cross_covariance.T  # li2020 (10), P_z K^T = cross^T
    return mean + gain @ innovation, 0.5 * (updated + updated.T)  # li2020 (9)
