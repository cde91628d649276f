r"""How fast each IMU's heading drifts, as by the bias of a gyroscope without a magnetometer.

The heading ψ of an IMU's reference frame is a part of the error state. Its drift β, which walks
slowly, is estimated beside it: with the variance V of β and its covariance C with ψ,

.. math:: \psi \mathrel{+}= \beta\,dt, \quad P_\psi \mathrel{+}= 2 C\,dt + V\,dt^2, \quad
          C \mathrel{+}= V\,dt, \quad V \mathrel{+}= q\,dt

An update that moves ψ by δ, and its variance from :math:`P_\psi^-` to :math:`P_\psi^+`, tells of β

.. math:: \beta \mathrel{+}= g\,\delta, \quad V \mathrel{-}= g^2 (P_\psi^- - P_\psi^+), \quad
          C = g\,P_\psi^+, \quad g = C / P_\psi^-

This is the Kalman filter of both, if β is correlated with the rest of the state through ψ alone.
It spares a column of P for each IMU. What the bias adds to the gyroscope's rate is below its noise.
"""

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.filter.state import NO_COLUMN, FilterState
from pose_core.kernels.compiling import compiled_in_place, compiled_into_caller


@compiled_in_place
def predict_headings(state: FilterState, walk: float, drift_walk: float, dt_s: float) -> None:
    """Advance the headings and their drifts by ``dt_s`` [s], in place.

    Args:
        state: The state.
        walk: Process noise of a heading [rad²/s].
        drift_walk: The same of its drift [rad²/s³].
        dt_s: Time step [s].
    """
    imus, P = state.imus, state.P
    for link in range(len(imus.column)):
        if imus.column[link] == NO_COLUMN:
            continue
        own = imus.column[link] + 3
        imus.heading[link] += imus.drift[link] * dt_s
        growth = 2.0 * imus.drift_covariance[link] + imus.drift_variance[link] * dt_s
        P[own, own] += (growth + walk) * dt_s
        imus.drift_covariance[link] += imus.drift_variance[link] * dt_s
        imus.drift_variance[link] += drift_walk * dt_s


@compiled_into_caller
def heading_variances(state: FilterState) -> FloatArray:
    """Variance of each IMU's heading, (links,) [rad²]; 0 without an aligned IMU."""
    variances = np.zeros(len(state.imus.column))
    for link in range(len(variances)):
        if state.imus.column[link] != NO_COLUMN:
            own = state.imus.column[link] + 3
            variances[link] = state.P[own, own]
    return variances


@compiled_in_place
def update_drifts(state: FilterState, before: FloatArray, error: FloatArray) -> None:
    """Update the drifts by an update's correction of the headings.

    Args:
        state: The state; P is the posterior.
        before: The headings' variances before the update, (links,) [rad²].
        error: The correction of the state, (n,).
    """
    imus = state.imus
    for link in range(len(before)):
        if before[link] <= 0.0:
            continue
        own = imus.column[link] + 3
        gain = imus.drift_covariance[link] / before[link]
        imus.drift[link] += gain * error[own]
        imus.drift_variance[link] -= gain**2 * (before[link] - state.P[own, own])
        imus.drift_covariance[link] = gain * state.P[own, own]
