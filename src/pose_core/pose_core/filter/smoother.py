r"""Rauch–Tung–Striebel smoothing of the default filter's steps.

.. math:: G_k = P_k F^T (P^-_{k+1})^{-1}, \quad
          x^s_k = x_k \oplus G_k (x^s_{k+1} \ominus x^-_{k+1}), \quad
          P^s_k = P_k + G_k (P^s_{k+1} - P^-_{k+1}) G_k^T

with differences on the manifold, of positions, rotations and their rates. The alignment of the IMUs
is not smoothed. Nor are the slides: the trackers' slow offsets are correlated over the window, and
smoothed slides take them in.

References:
    Rauch, Tung, Striebel (1965), AIAA Journal 3(8).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, cho_factor, cho_solve
from scipy.spatial.transform import Rotation

from pose_core.arrays import FloatArray
from pose_core.filter.layout import Layout
from pose_core.filter.motion import MAX_STDDEV, rate_decay
from pose_core.filter.state import NO_COLUMN, FilterState, inject_error
from pose_core.filter.tuning import MotionPrior

AT_BOUND = 1.0 - 1e-6  # [-] of the largest variance of a rotation


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
    columns = np.r_[: layout.first_slide, layout.first_rate : layout.body_size]
    result = [of_body(steps[-1].updated, layout)]
    for step, following in zip(steps[-2::-1], steps[:0:-1], strict=True):
        state = of_body(step.updated, layout)
        if following.predicted is not None:
            F = transition(layout, motion, following.dt_s)
            _smooth(state, result[-1], following.predicted, F, columns)
        result.append(state)
    return result[::-1]


def _smooth(
    state: FilterState,
    later: FilterState,
    predicted: FilterState,
    F: FloatArray,
    columns: NDArray[np.int64],
) -> None:
    """Correct a state by the next smoothed state, in place; unchanged if P is singular.

    Nor is it changed where the prediction has reached the bound of unobserved rotations, which F
    does not model: over seconds without a camera the gain would grow.

    Args:
        state: The filter's state.
        later: The next one, smoothed.
        predicted: The next one, as predicted from ``state``.
        F: Transition matrix from ``state`` to ``predicted``.
        columns: Columns of P that F, (m, m), is of, (m,).
    """
    own = np.ix_(columns, columns)
    P, P_predicted = state.P[own], predicted.P[own]
    rotations = np.diag(P_predicted)[3 : len(columns) // 2]
    if rotations.max() >= AT_BOUND * MAX_STDDEV**2:
        return
    try:
        G = cho_solve(cho_factor(P_predicted), F @ P).T
    except LinAlgError:
        return
    error = np.zeros(len(state.P))
    error[columns] = G @ difference(later, predicted)
    inject_error(state, error)
    covariance = P + G @ (later.P[own] - P_predicted) @ G.T
    if np.all(np.diag(covariance) > 0.0):
        state.P[own] = 0.5 * (covariance + covariance.T)


def of_body(state: FilterState, layout: Layout) -> FilterState:
    """Copy of a state whose covariance excludes the alignment of the IMUs."""
    copied = state.copy()
    body = np.ascontiguousarray(copied.P[: layout.body_size, : layout.body_size])
    copied.imus.column[:] = NO_COLUMN
    copied.shared.column[:] = NO_COLUMN
    return copied._replace(P=body)


def transition(layout: Layout, motion: MotionPrior, dt_s: float) -> FloatArray:
    """Transition matrix F of positions, rotations and their rates over ``dt_s`` [s], (m, m)."""
    keep, rate_time_s = rate_decay(motion.rate_memory, dt_s)
    steps = np.array([[1.0, rate_time_s], [0.0, keep]])
    return np.asarray(np.kron(steps, np.eye(layout.first_slide)), float)


def difference(state: FilterState, other: FilterState) -> FloatArray:
    """The error that moves ``other`` to ``state``: state ⊖ other without slides, (m,)."""
    pose, from_pose = state.pose, other.pose
    turns = Rotation.from_matrix(pose.rotations @ np.swapaxes(from_pose.rotations, 1, 2))
    return np.concatenate(
        [
            pose.position - from_pose.position,
            turns.as_rotvec().ravel(),
            pose.velocity - from_pose.velocity,
            (pose.rates - from_pose.rates).ravel(),
        ]
    )
