"""Errors of published degrees of freedom, and their coverage by published standard deviations."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from pose_core.api import (
    ABDUCTION_OF,
    ANGLES,
    SkeletonSeries,
    angle_series,
    unwrapped,
    wrapped,
)
from pose_core.arrays import FloatArray
from pose_core.streams.angle_series import SIDEWAYS
from pose_evaluation.offline import MethodRun


@dataclass(frozen=True, kw_only=True)
class Truth:
    """Ground truth of a session."""

    whole: SkeletonSeries
    judged: SkeletonSeries  # the evaluated part
    angles: Mapping[str, FloatArray]  # (n,) [rad] the twelve angles of the whole


def truth_of_series(series: SkeletonSeries, judged_from_ns: int) -> Truth:
    """The truth of a session whose true skeletons are evaluated from an instant [ns] on."""
    angles = angle_series(series).angles
    return Truth(
        whole=series,
        judged=series.between(judged_from_ns, int(series.stamps_ns[-1])),
        angles={name: unwrapped(angles[name]) for name in ANGLES},
    )


def dof_errors(
    run: MethodRun, truth: Truth, shift_s: float
) -> dict[str, tuple[FloatArray, FloatArray]]:
    """Errors [rad] of the published angles and their standard deviations [rad], by name.

    At the estimates' instants, after one time shift; flexions are left out where the true limb
    points sideways.
    """
    judged = truth.judged.stamps_ns
    estimates = run.estimates
    stamps_ns = estimates.stamps_ns - round(shift_s * 1e9)
    inside = (stamps_ns >= judged[0]) & (stamps_ns <= judged[-1])
    begin_ns = truth.whole.stamps_ns[0]  # differences are exact as floats, stamps are not
    times = (stamps_ns[inside] - begin_ns) * 1e-9
    grid = (truth.whole.stamps_ns - begin_ns) * 1e-9
    errors = {}
    for name in ANGLES:
        if name not in estimates.names:
            continue
        column = estimates.names.index(name)
        true = np.interp(times, grid, truth.angles[name])
        error = wrapped(estimates.position[inside, column] - true)
        if name in ABDUCTION_OF:
            abduction = np.interp(times, grid, truth.angles[ABDUCTION_OF[name]])
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
