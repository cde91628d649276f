r"""The rigid transform between two clouds of matched points, plain and robust.

.. math:: \min_{R, t} \sum_i w_i \| p^{target}_i - (R\,p^{source}_i + t) \|^2
"""

from dataclasses import dataclass

import numpy as np

from pose_core.api import FloatArray, best_rigid_transform, transformed
from pose_core.errors import PoseError

MIN_SPREAD_M = 0.02  # [m] RMS along the second principal axis; below, a line leaves a free rotation
MIN_SPREAD_RATIO = 0.01  # [-] second to first principal axis
HYPOTHESES = 256  # [-] at 30 % outliers, 88 triples without outliers are expected
SCORED_POINTS = 1500  # [-] enough for a median
SEED = 2020
MAX_ITERATIONS = 50
CONVERGED_M = 1e-6  # [m] change of the points' mean position and spread that ends the iteration
TUKEY = 4.685  # [-] 95 % efficiency for Gaussian residuals
MAXWELL_MEDIAN = 1.5382  # [-] median length of a 3-D Gaussian vector of unit deviation
MIN_SIGMA_M = 0.001  # [m] lower bound, against division by rounding errors


class CalibrationError(PoseError):
    """The recording does not determine a calibration; the message says why and what to do."""


@dataclass(frozen=True, kw_only=True)
class RobustFit:
    """A rigid transform and its residuals."""

    T_target_source: FloatArray  # (4, 4)
    residuals: FloatArray  # (n,) [m] distance of each pair after the transform
    weights: FloatArray  # (n,) [-] robust weight, 0 for an outlier, 1 for perfect agreement

    @property
    def median(self) -> float:
        """Median residual [m]."""
        return float(np.median(self.residuals))


def spread(points: FloatArray, weights: FloatArray | None = None) -> FloatArray:
    """RMS extent of a point cloud along its principal axes [m], shape (3,), descending.

    Args:
        points: Shape (n, 3) [m].
        weights: Shape (n,) [-], equal ones if None.
    """
    weights = np.ones(len(points)) if weights is None else weights
    share = weights / weights.sum()
    centred = points - share @ points
    variances = np.linalg.eigvalsh((share[:, None] * centred).T @ centred)[::-1]
    return np.asarray(np.sqrt(np.maximum(variances, 0.0)))


def estimate_rigid_transform(
    source: FloatArray, target: FloatArray, weights: FloatArray | None = None
) -> FloatArray:
    """Estimate the transform between two clouds of matched points by weighted least squares.

    Args:
        source: Points [m] in the source frame, shape (n, 3).
        target: The same points [m] in the target frame, shape (n, 3).
        weights: Shape (n,) [-], equal ones if None.

    Returns:
        ``T_target_source``, shape (4, 4).

    Raises:
        CalibrationError: If there are fewer than three points, or they are (nearly) collinear.

    References:
        Kabsch (1976), Acta Cryst. A32; Umeyama (1991), IEEE TPAMI 13(4), with unit scale.
    """
    weights = np.ones(len(source)) if weights is None else np.asarray(weights, dtype=float)
    used = weights > 0.0
    if used.sum() < 3:
        raise CalibrationError(
            f"found {used.sum()} matched points, expected 3 or more: calibrate where both sensors "
            "see the person"
        )
    if not used.all():
        source, target, weights = source[used], target[used], weights[used]
    for points in (source, target):
        extents = spread(points, weights)
        if extents[1] < max(MIN_SPREAD_M, MIN_SPREAD_RATIO * extents[0]):
            raise CalibrationError(
                "joints are nearly collinear (spread "
                + ", ".join(f"{extent:.3f}" for extent in extents)
                + " m along the principal axes): move the arms away from the trunk, walk about, "
                "and calibrate again"
            )
    return best_rigid_transform(source, target, weights)


def estimate_rigid_transform_robustly(source: FloatArray, target: FloatArray) -> RobustFit:
    """Estimate the transform between two clouds with many outliers.

    The best of many transforms through three random pairs (least median of residuals; the
    seed is fixed, so the same points give the same result) starts an iteration of reweighted least
    squares with Tukey's biweight, whose scale follows the median residual.

    Args:
        source: Points [m] in the source frame, shape (n, 3).
        target: The same points [m] in the target frame, shape (n, 3).

    Raises:
        CalibrationError: If there are fewer than three points, or they are (nearly) collinear.

    References:
        Rousseeuw (1984), JASA 79(388); Holland and Welsch (1977), Comm. Stat. A6(9).
    """
    T = estimate_rigid_transform(source, target)
    T = _best_hypothesis(source, target, T)
    for _ in range(MAX_ITERATIONS):
        _, robust = _reweighted(T, source, target)
        previous = T
        T = estimate_rigid_transform(source, target, robust)
        moved = transformed(T - previous, source)
        if np.sqrt(_squared_lengths(moved).mean()) < CONVERGED_M:
            break
    residuals, robust = _reweighted(T, source, target)
    return RobustFit(T_target_source=T, residuals=residuals, weights=robust)


def _reweighted(
    T: FloatArray, source: FloatArray, target: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Residuals [m] of the pairs, and Tukey's weights of their median."""
    residuals = np.sqrt(_squared_lengths(target - transformed(T, source)))
    sigma = max(MIN_SIGMA_M, float(np.median(residuals)) / MAXWELL_MEDIAN)
    ratio = np.minimum(residuals / (TUKEY * sigma), 1.0)
    return residuals, (1.0 - ratio**2) ** 2


def _best_hypothesis(source: FloatArray, target: FloatArray, fallback: FloatArray) -> FloatArray:
    """The transform with the least median residual, of many through three random pairs."""
    rng = np.random.default_rng(SEED)
    triples = rng.integers(0, len(source), (HYPOTHESES, 3))
    edges = source[triples[:, 1:]] - source[triples[:, :1]]
    area = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
    triples = triples[area > MIN_SPREAD_M**2]
    through_triples = best_rigid_transform(source[triples], target[triples])
    candidates = np.concatenate([fallback[None], through_triples])
    scored = rng.choice(len(source), min(SCORED_POINTS, len(source)), replace=False)
    squares = np.zeros((len(candidates), len(scored)))
    for axis in range(3):
        moved = candidates[:, axis, :3] @ source[scored].T + candidates[:, axis, 3:]
        squares += (moved - target[scored, axis]) ** 2
    half = len(scored) // 2
    medians = np.partition(squares, half, axis=1)[:, half]
    return candidates[np.argmin(medians)]


def _squared_lengths(vectors: FloatArray) -> FloatArray:
    """Squared norms of vectors (n, 3), shape (n,)."""
    return np.asarray(np.einsum("ij,ij->i", vectors, vectors))
