r"""Rauch–Tung–Striebel smoothing of a segment filter: what came later tells of what was before.

.. math:: G_k = P_k F^T (P^-_{k+1})^{-1}, \quad
          x^s_k = x_k \oplus G_k (x^s_{k+1} \ominus x^-_{k+1}), \quad
          P^s_k = P_k + G_k (P^s_{k+1} - P^-_{k+1}) G_k^T

with differences taken on the manifold.

References:
    Rauch, Tung, Striebel (1965), AIAA Journal 3(8).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.spatial.transform import Rotation

from pose_core.filters.motion_prior import MotionPrior
from pose_core.filters.segment_state import Layout, SegmentState
from pose_core.kernels.prediction import move
from pose_core.streams.samples import FloatArray


@dataclass(frozen=True, kw_only=True)
class FilterStep:
    """One step of the filter."""

    dt_s: float  # [s] since the step before
    predicted: SegmentState | None  # None: it does not follow from the step before
    updated: SegmentState


def smoothed(steps: Sequence[FilterStep], motion: MotionPrior) -> list[SegmentState]:
    """The states of all steps, each knowing all later ones too.

    Args:
        steps: In order of time, at least one.
        motion: The prior that the filter predicts with.
    """
    last = steps[-1].updated
    layout = Layout(len(last.rotations), len(last.slides))
    result = [last]
    for step, following in zip(steps[-2::-1], steps[:0:-1], strict=True):
        later, predicted = result[-1], following.predicted
        if predicted is None:
            result.append(step.updated)
            continue
        F = transition(layout, motion, following.dt_s)
        P = step.updated.covariance
        G = cho_solve(cho_factor(predicted.covariance), F @ P).T
        state = step.updated.copy()
        move(state.pose, G @ difference(later, predicted))
        covariance = P + G @ (later.covariance - predicted.covariance) @ G.T
        covariance = 0.5 * (covariance + covariance.T)
        if is_positive(covariance):
            state.covariance = covariance
        # else the filter's own is kept: F leaves out that an unseen turn grows no further
        result.append(state)
    return result[::-1]


def transition(layout: Layout, motion: MotionPrior, dt_s: float) -> FloatArray:
    """F of the filter's prediction over ``dt_s`` [s], shape (size, size)."""
    keep = float(np.exp(-dt_s / motion.rate_memory))
    F = np.eye(layout.size)
    F[layout.moving, layout.rates] = motion.rate_memory * (1.0 - keep) * np.eye(layout.moving_size)
    F[layout.rates, layout.rates] *= keep
    F[layout.slide, layout.slide] *= float(np.exp(-dt_s / motion.slide_memory))
    return F


def is_positive(covariance: FloatArray) -> bool:
    """Whether every direction has a variance above zero."""
    try:
        np.linalg.cholesky(covariance)
    except np.linalg.LinAlgError:
        return False
    return True


def difference(state: SegmentState, other: SegmentState) -> FloatArray:
    """The error that moves ``other`` to ``state``, shape (size,)."""
    turns = Rotation.from_matrix(state.rotations @ np.swapaxes(other.rotations, 1, 2))
    return np.concatenate(
        [
            state.position - other.position,
            turns.as_rotvec().ravel(),
            (state.slides - other.slides).ravel(),
            state.velocity - other.velocity,
            (state.rates - other.rates).ravel(),
        ]
    )
