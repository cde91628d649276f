r"""Rauch–Tung–Striebel smoothing of the default filter's steps.

.. math:: G_k = P_k F^T (P^-_{k+1})^{-1}, \quad
          x^s_k = x_k \oplus G_k (x^s_{k+1} \ominus x^-_{k+1}), \quad
          P^s_k = P_k + G_k (P^s_{k+1} - P^-_{k+1}) G_k^T

with differences on the manifold. The alignment of the IMUs is not smoothed.

References:
    Rauch, Tung, Striebel (1965), AIAA Journal 3(8).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve
from scipy.spatial.transform import Rotation

from pose_core.filter.layout import Layout
from pose_core.filter.state import FilterState, inject_error
from pose_core.filter.tuning import MotionPrior
from pose_core.streams.samples import FloatArray


@dataclass(frozen=True, kw_only=True)
class FilterStep:
    """One step of the filter."""

    dt_s: float  # [s] since the step before
    predicted: FilterState | None  # None: the filter was restarted or corrected in between
    updated: FilterState


def smoothed(steps: Sequence[FilterStep], layout: Layout, motion: MotionPrior) -> list[FilterState]:
    """Smoothed states of all steps; their P contains only the body's part.

    Args:
        steps: In temporal order, at least one.
        layout: Layout of the error state.
        motion: Process model of the filter.
    """
    result = [of_body(steps[-1].updated, layout)]
    for step, following in zip(steps[-2::-1], steps[:0:-1], strict=True):
        state = of_body(step.updated, layout)
        if following.predicted is not None:
            predicted = of_body(following.predicted, layout)
            _smooth(state, result[-1], predicted, transition(layout, motion, following.dt_s))
        result.append(state)
    return result[::-1]


def _smooth(state: FilterState, later: FilterState, predicted: FilterState, F: FloatArray) -> None:
    """Correct a state by the next smoothed state, in place; unchanged if P is singular."""
    try:
        G = cho_solve(cho_factor(predicted.P), F @ state.P).T
    except LinAlgError:
        return
    covariance = state.P + G @ (later.P - predicted.P) @ G.T
    inject_error(state, G @ difference(later, predicted))
    if np.all(np.diag(covariance) > 0.0):
        state.P[:] = 0.5 * (covariance + covariance.T)
    # Otherwise keep the filter's: F does not model the bound of unobserved rotations.


def of_body(state: FilterState, layout: Layout) -> FilterState:
    """Copy of a state whose covariance excludes the alignment of the IMUs."""
    copied = state.copy()
    body = np.ascontiguousarray(copied.P[: layout.imus, : layout.imus])
    copied.imu_column[:] = -1
    return copied._replace(P=body)


def transition(layout: Layout, motion: MotionPrior, dt_s: float) -> FloatArray:
    """Transition matrix F of the body's part over ``dt_s`` [s], shape (n, n)."""
    keep = float(np.exp(-dt_s / motion.rate_memory))
    moving = layout.slide
    F = np.eye(layout.imus)
    rates = slice(layout.velocity, layout.imus)
    F[:moving, rates] = motion.rate_memory * (1.0 - keep) * np.eye(moving)
    F[rates, rates] *= keep
    slides = slice(layout.slide, layout.velocity)
    F[slides, slides] *= float(np.exp(-dt_s / motion.slide_memory))
    return F


def difference(state: FilterState, other: FilterState) -> FloatArray:
    """The error that moves ``other`` to ``state``: state ⊖ other, shape (n,)."""
    pose, from_pose = state.pose, other.pose
    turns = Rotation.from_matrix(pose.rotations @ np.swapaxes(from_pose.rotations, 1, 2))
    return np.concatenate(
        [
            pose.position - from_pose.position,
            turns.as_rotvec().ravel(),
            (pose.slides - from_pose.slides).ravel(),
            pose.velocity - from_pose.velocity,
            (pose.rates - from_pose.rates).ravel(),
        ]
    )
