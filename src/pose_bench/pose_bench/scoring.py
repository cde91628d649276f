"""Errors of published degrees of freedom, and their coverage by published standard deviations."""

from collections.abc import Mapping, Sequence
from typing import Protocol

import numpy as np

from pose_core.api import ABDUCTION_OF, ANGLES, SkeletonSeries, wrapped
from pose_core.arrays import FloatArray
from pose_core.streams.angle_series import SIDEWAYS
from pose_evaluation.offline import MethodRun

HIP_AND_KNEE = tuple(angle for angle in ANGLES if "hip" in angle or "knee" in angle)


class Truth(Protocol):
    """Ground truth of a session: captured or synthetic."""

    @property
    def truth(self) -> SkeletonSeries:
        """The true skeletons."""

    @property
    def judged_truth(self) -> SkeletonSeries:
        """The evaluated part."""

    @property
    def true_angles(self) -> Mapping[str, FloatArray]:
        """Angles [rad] at the truth's stamps, (n,) each."""


def dof_errors(
    run: MethodRun, session: Truth, shift_s: float, names: Sequence[str]
) -> dict[str, tuple[FloatArray, FloatArray]]:
    """Errors [rad] of published degrees of freedom and their standard deviations [rad], by name.

    At the estimates' instants, after one time shift; flexions are left out where the true limb
    points sideways.
    """
    judged = session.judged_truth.stamps_ns
    estimates = run.estimates
    stamps_ns = estimates.stamps_ns - round(shift_s * 1e9)
    inside = (stamps_ns >= judged[0]) & (stamps_ns <= judged[-1])
    begin_ns = session.truth.stamps_ns[0]  # differences are exact as floats, stamps are not
    times = (stamps_ns[inside] - begin_ns) * 1e-9
    grid = (session.truth.stamps_ns - begin_ns) * 1e-9
    errors = {}
    for name in names:
        if name not in estimates.names:
            continue
        column = estimates.names.index(name)
        true = np.interp(times, grid, session.true_angles[name])
        error = wrapped(estimates.position[inside, column] - true)
        if name in ABDUCTION_OF:
            abduction = np.interp(times, grid, session.true_angles[ABDUCTION_OF[name]])
            error = np.where(np.abs(abduction) > SIDEWAYS, np.nan, error)
        errors[name] = error, estimates.position_stddev[inside, column]
    return errors


def coverage(errors: Mapping[str, tuple[FloatArray, FloatArray]]) -> tuple[float, float]:
    """Shares of the errors within 1 and 2 standard deviations, all angles together."""
    if not errors:
        return np.nan, np.nan
    error, stddev = (np.concatenate(columns) for columns in zip(*errors.values(), strict=True))
    known = np.isfinite(error) & np.isfinite(stddev)
    if not known.any():
        return np.nan, np.nan
    size = np.abs(error[known])
    within_1, within_2 = (float(np.mean(size <= n * stddev[known])) for n in (1.0, 2.0))
    return within_1, within_2
